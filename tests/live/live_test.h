// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <csignal>
#include <cstdlib>

#include "app_process.h"
#include "fastdds_peer.h"

namespace d2s1r::test
{
/// A process that ends with its owner, so that it answers no other test.
class LiveProcess : public Process
{
   public:
	using Process::Process;
	~LiveProcess()
	{
		if (!running()) return;
		send(SIGKILL);
		wait();
	}
};

/// A variable of the environment of the processes that start while it lives.
struct EnvironmentVariable
{
	EnvironmentVariable(const char* given_name, const char* value) : name(given_name) { setenv(name, value, 1); }
	~EnvironmentVariable() { unsetenv(name); }
	EnvironmentVariable(const EnvironmentVariable&) = delete;
	EnvironmentVariable& operator=(const EnvironmentVariable&) = delete;
	const char* name;
};

/// d2s1r-live as a user runs it, beside a peer of another vendor.
class LiveTest : public AppTest
{
   protected:
	LiveProcess start_live(Words arguments = {}) const
	{
		arguments.insert(arguments.begin(), {D2S1R_LIVE, "--domain", std::to_string(test_domain())});
		return {arguments, folder()};
	}

	/// Lets a robot stand and publish until its scans are answered.
	static bool wait_for_answers(RobotPeer& robot)
	{
		return wait_until([&] { return robot.step(0, 0, 0.1); }, 15);
	}

	/// Stops the process, and returns what it said.
	static ProcessResult stop(Process& live)
	{
		live.send(SIGTERM);
		return live.wait();
	}

	std::string said() const { return text_of(folder() / "stdout"); }

	/// Returns an empty text while there is no such file.
	static std::string text_of(const std::filesystem::path& file)
	{
		return std::filesystem::exists(file) ? read_file(file) : "";
	}

	bool says(const std::string& part, double seconds = 8) const
	{
		return wait_until([&] { return said().find(part) != std::string::npos; }, seconds);
	}
};

/// Expects one line that says what is wrong and what to do.
inline void expect_refused(const ProcessResult& result, int status, const Words& parts)
{
	EXPECT_EQ(result.status, status) << result.err;
	EXPECT_EQ(result.out, "");
	EXPECT_EQ(result.err.rfind("d2s1r-live: ", 0), 0U) << result.err;
	EXPECT_EQ(lines_of(result.err).size(), 1U) << result.err;
	for (const std::string& part : parts) EXPECT_NE(result.err.find(part), std::string::npos) << result.err;
}

inline std::string last_summary(RobotPeer& robot)
{
	const auto message = robot.diagnostics.next(3);
	return message && !message->status().empty() ? message->status().front().message() : "";
}
}  // namespace d2s1r::test
