// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The binary as a user runs it.
#pragma once

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <filesystem>
#include <string>
#include <vector>

namespace d2s1r::test
{
using Words = std::vector<std::string>;

/// What a finished process left.
struct ProcessResult
{
	int status = -1;  //!< exit status, 128 + signal if it was killed
	std::string out;  //!< standard output
	std::string err;  //!< standard error
	long memory = 0;  //!< [kB] that the process, or one that it started, had at most
};

/// A running process; standard input is empty, neither output is a terminal.
class Process
{
   public:
	/// \param command program (looked up in PATH) and arguments
	/// \param folder for the captured output
	Process(const Words& command, const std::filesystem::path& folder);
	void send(int signal) const;
	bool running();
	ProcessResult wait();

	/// Returns how much memory [kB] a process that runs has now.
	long memory() const;

   private:
	std::filesystem::path out_;
	std::filesystem::path err_;
	int id_;
	int wait_status_ = 0;
	rusage usage_ = {};
	bool ended_ = false;
};

/// Returns the number of cases that a test injects faults in: `few`, or `all` if D2S1R_ALL_FAULTS is in the
/// environment.
int fault_cases(int few, int all);

std::string read_file(const std::filesystem::path& path);
void write_file(const std::filesystem::path& path, const std::string& content);
std::vector<std::string> lines_of(const std::string& text);

/// A fresh folder a test, removed afterwards.
class AppTest : public testing::Test
{
   protected:
	AppTest();
	~AppTest() override;

	std::string path(const std::string& name) const { return (folder_ / name).string(); }
	const std::filesystem::path& folder() const { return folder_; }

	Process start(const Words& arguments) const;
	ProcessResult run(const Words& arguments) const { return start(arguments).wait(); }
	ProcessResult run_program(const Words& command) const { return Process(command, folder_).wait(); }

	/// Words for bash, after which descriptor 4 leads to a pipe that nobody reads.
	std::string pipe_that_nobody_reads() const
	{
		const std::string pipe = path("pipe");
		return "[ -p " + pipe + " ] || mkfifo " + pipe + "; exec 3<> " + pipe + " 4> " + pipe + " 3>&-; ";
	}

	/// As a user for whom permissions count, which they do not for root; the inputs have to be readable by all.
	ProcessResult run_as_ordinary_user(const Words& arguments) const;

	/// Expect the exit status, nothing on standard output, and one line on standard error that holds all `parts`.
	void expect_refusal(const Words& arguments, int status, const Words& parts) const
	{
		expect_refused(run(arguments), status, parts);
	}
	static void expect_refused(const ProcessResult& result, int status, const Words& parts);

   private:
	std::filesystem::path folder_;
};

/// Rows of a CSV file by column name; the header is checked to be `header`.
class CsvTable
{
   public:
	CsvTable(const std::filesystem::path& path, const std::string& header);
	std::size_t size() const { return rows_.size(); }
	const std::string& text(std::size_t row, const std::string& column) const;
	double number(std::size_t row, const std::string& column) const { return std::stod(text(row, column)); }

	/// All fields row by row, without the columns of times, which end in _ms.
	std::vector<std::vector<std::string>> without_times() const;

   private:
	std::vector<std::string> columns_;
	std::vector<std::vector<std::string>> rows_;
};

inline constexpr const char* kFramesHeader =
    "frame,timestamp,status,x,y,phi,std_x,std_y,std_phi,confidence,hypotheses,relative_entropy,retrieval_ms,"
    "registration_ms,refinement_ms,total_ms,cov_xx,cov_xy,cov_xphi,cov_yy,cov_yphi,cov_phiphi,note,map";
inline constexpr const char* kHypothesesHeader = "frame,rank,x,y,phi,probability,std_x,std_y,std_phi,map";
}  // namespace d2s1r::test
