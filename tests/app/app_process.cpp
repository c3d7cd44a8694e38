// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "app_process.h"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace d2s1r::test
{
namespace fs = std::filesystem;

Process::Process(const Words& command, const fs::path& folder)
    : out_(folder / "stdout"), err_(folder / "stderr"), id_(fork())
{
	if (id_ < 0) throw std::runtime_error("fork failed");
	if (id_ > 0) return;
	// The tests may run under nohup or with `&` in a script, which ignore signals.
	for (const int signal : {SIGHUP, SIGINT}) std::signal(signal, SIG_DFL);
	const auto redirect = [](const char* file, int flags, int descriptor)
	{ dup2(open(file, flags | O_CREAT | O_TRUNC, 0644), descriptor); };
	redirect("/dev/null", O_RDONLY, STDIN_FILENO);
	redirect(out_.c_str(), O_WRONLY, STDOUT_FILENO);
	redirect(err_.c_str(), O_WRONLY, STDERR_FILENO);
	std::vector<char*> pointers;
	for (const auto& word : command) pointers.push_back(const_cast<char*>(word.c_str()));
	pointers.push_back(nullptr);
	execvp(pointers[0], pointers.data());
	_exit(127);
}

void Process::send(int signal) const
{
	kill(id_, signal);
}

bool Process::running()
{
	if (!ended_) ended_ = wait4(id_, &wait_status_, WNOHANG, &usage_) == id_;
	return !ended_;
}

ProcessResult Process::wait()
{
	if (!ended_) wait4(id_, &wait_status_, 0, &usage_);
	ended_ = true;
	const int status = WIFEXITED(wait_status_) ? WEXITSTATUS(wait_status_) : 128 + WTERMSIG(wait_status_);
	return {status, read_file(out_), read_file(err_), usage_.ru_maxrss};
}

long Process::memory() const
{
	for (const std::string& line : lines_of(read_file("/proc/" + std::to_string(id_) + "/status")))
		if (line.rfind("VmRSS:", 0) == 0) return std::stol(line.substr(6));
	throw std::runtime_error("the process has ended");
}

int fault_cases(int few, int all)
{
	return std::getenv("D2S1R_ALL_FAULTS") ? all : few;
}

std::string read_file(const fs::path& path)
{
	std::ifstream in(path, std::ios::binary);
	if (!in) throw std::runtime_error("cannot read " + path.string());
	std::ostringstream content;
	content << in.rdbuf();
	return content.str();
}

void write_file(const fs::path& path, const std::string& content)
{
	std::ofstream out(path, std::ios::binary);
	out << content;
	if (!out.flush()) throw std::runtime_error("cannot write " + path.string());
}

std::vector<std::string> lines_of(const std::string& text)
{
	std::istringstream in(text);
	std::vector<std::string> lines;
	for (std::string line; std::getline(in, line);) lines.push_back(line);
	return lines;
}

AppTest::AppTest()
{
	std::string name = (fs::temp_directory_path() / "d2s1r-app-XXXXXX").string();
	if (!mkdtemp(name.data())) throw std::runtime_error("cannot make a folder for the test");
	folder_ = name;
}

AppTest::~AppTest()
{
	std::error_code ignored;
	fs::remove_all(folder_, ignored);
}

Process AppTest::start(const Words& arguments) const
{
	Words command = {RAWLOG_LOCALIZE};
	command.insert(command.end(), arguments.begin(), arguments.end());
	return Process(command, folder_);
}

ProcessResult AppTest::run_as_ordinary_user(const Words& arguments) const
{
	fs::permissions(folder_, fs::perms::owner_all | fs::perms::group_exec | fs::perms::others_exec);
	Words command = {RAWLOG_LOCALIZE};
	if (geteuid() == 0) command = {"setpriv", "--reuid=65534", "--clear-groups", RAWLOG_LOCALIZE};
	command.insert(command.end(), arguments.begin(), arguments.end());
	return run_program(command);
}

void AppTest::expect_refused(const ProcessResult& result, int status, const Words& parts)
{
	EXPECT_EQ(result.status, status);
	EXPECT_EQ(result.out, "");
	EXPECT_EQ(lines_of(result.err).size(), 1U) << result.err;
	EXPECT_EQ(result.err.rfind("rawlog-localize: ", 0), 0U) << result.err;
	for (const auto& part : parts)
		EXPECT_NE(result.err.find(part), std::string::npos) << result.err << "lacks: " << part;
}

CsvTable::CsvTable(const fs::path& path, const std::string& header)
{
	const auto split = [](const std::string& line)
	{
		std::vector<std::string> fields(1);
		bool quoted = false;
		for (const char c : line)
			if (c == '"')
				quoted = !quoted;
			else if (c == ',' && !quoted)
				fields.emplace_back();
			else
				fields.back() += c;
		return fields;
	};
	const auto lines = lines_of(read_file(path));
	if (lines.empty() || lines[0] != header) throw std::runtime_error(path.string() + ": other header");
	columns_ = split(lines[0]);
	for (std::size_t i = 1; i < lines.size(); i++)
	{
		rows_.push_back(split(lines[i]));
		if (rows_.back().size() != columns_.size()) throw std::runtime_error(path.string() + ": " + lines[i]);
	}
}

std::vector<std::vector<std::string>> CsvTable::without_times() const
{
	std::vector<std::vector<std::string>> kept(rows_.size());
	for (std::size_t row = 0; row < rows_.size(); row++)
		for (std::size_t i = 0; i < columns_.size(); i++)
			if (columns_[i].find("_ms") == std::string::npos) kept[row].push_back(rows_[row][i]);
	return kept;
}

const std::string& CsvTable::text(std::size_t row, const std::string& column) const
{
	const auto found = std::find(columns_.begin(), columns_.end(), column);
	if (found == columns_.end()) throw std::runtime_error("no column " + column);
	return rows_.at(row).at(static_cast<std::size_t>(found - columns_.begin()));
}
}  // namespace d2s1r::test
