// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <base/own_process.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <iostream>
#include <stdexcept>
#include <vector>

namespace d2s1r
{
namespace
{
constexpr ProcessLimits kLimits{300'000'000, 20};

struct Outcome
{
	ProcessEnd end = ProcessEnd::kDone;
	std::vector<std::string> records;
};

bool never()
{
	return false;
}

Outcome run(const std::function<void(const Send&)>& work, const ProcessLimits& limits = kLimits)
{
	Outcome outcome;
	outcome.end = run_in_own_process(
	    limits, work, [&](const std::string& record) { outcome.records.push_back(record); }, never);
	return outcome;
}

TEST(OwnProcess, HandsOnItsRecordsInOrderWhateverTheyHold)
{
	const std::vector<std::string> records = {"one", "", std::string(3, '\0'), std::string(5'000'000, 'x'), "end\n"};
	const Outcome outcome = run(
	    [&](const Send& send)
	    {
		    for (const std::string& record : records) send(record);
	    });
	EXPECT_EQ(outcome.end, ProcessEnd::kDone);
	EXPECT_EQ(outcome.records, records);
}

TEST(OwnProcess, ChangesNothingHereAndPrintsNothing)
{
	int number = 1;
	testing::internal::CaptureStdout();
	const Outcome outcome = run(
	    [&](const Send&)
	    {
		    number = 2;
		    std::cout << "shouted" << std::endl;
	    });
	EXPECT_EQ(outcome.end, ProcessEnd::kDone);
	EXPECT_EQ(number, 1);
	EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
}

TEST(OwnProcess, MayCrashAfterWhatItSent)
{
	const Outcome by_signal = run(
	    [](const Send& send)
	    {
		    send("first");
		    std::signal(SIGSEGV, SIG_DFL);
		    std::raise(SIGSEGV);
		    send("second");
	    });
	EXPECT_EQ(by_signal.end, ProcessEnd::kCrashed);
	EXPECT_EQ(by_signal.records, std::vector<std::string>{"first"});
	EXPECT_EQ(run([](const Send&) { throw std::runtime_error("nobody caught it"); }).end, ProcessEnd::kCrashed);
}

TEST(OwnProcess, EndsWhenItTakesTooMuchMemory)
{
	const auto take = [](std::size_t bytes)
	{
		return run(
		           [bytes](const Send& send)
		           {
			           std::vector<char> memory(bytes, 'x');
			           send(std::string(1, memory.back()));
		           })
		    .end;
	};
	EXPECT_EQ(take(kLimits.memory / 2), ProcessEnd::kDone);
#ifdef __SANITIZE_ADDRESS__
	GTEST_SKIP() << "AddressSanitizer ends the process by itself";
#endif
	EXPECT_EQ(take(kLimits.memory * 2), ProcessEnd::kOutOfMemory);
}

TEST(OwnProcess, EndsWhenItTakesTooLong)
{
	const Outcome outcome = run(
	    [](const Send&)
	    {
		    volatile unsigned i = 0;
		    while (true) i = i + 1;
	    },
	    {kLimits.memory, 1});
	EXPECT_EQ(outcome.end, ProcessEnd::kOutOfTime);
}

TEST(OwnProcess, IsGivenUpWhenItWaitsForEver)
{
	const Outcome outcome = run(
	    [](const Send& send)
	    {
		    send("the last sign of life");
		    while (true) pause();
	    },
	    {kLimits.memory, 1});
	EXPECT_EQ(outcome.end, ProcessEnd::kOutOfTime);
	EXPECT_EQ(outcome.records.size(), 1U);
	EXPECT_EQ(waitpid(-1, nullptr, WNOHANG), -1) << "no child is left to wait for";
}

TEST(OwnProcess, StopsWhenItIsAskedTo)
{
	int records = 0;
	const ProcessEnd end = run_in_own_process(
	    kLimits,
	    [](const Send& send)
	    {
		    while (true) send("more");
	    },
	    [&](const std::string&) { records++; }, [&] { return records > 100; });
	EXPECT_EQ(end, ProcessEnd::kInterrupted);
	EXPECT_EQ(waitpid(-1, nullptr, WNOHANG), -1) << "no child is left to wait for";
}

TEST(OwnProcess, LeavesNoProcessBehind)
{
	EXPECT_THROW(
	    run_in_own_process(
	        kLimits,
	        [](const Send& send)
	        {
		        while (true) send("more");
	        },
	        [](const std::string&) { throw std::runtime_error("enough"); }, never),
	    std::runtime_error);
	EXPECT_EQ(waitpid(-1, nullptr, WNOHANG), -1) << "no child is left to wait for";
}
}  // namespace
}  // namespace d2s1r
