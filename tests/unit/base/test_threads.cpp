// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <dlfcn.h>
#include <gtest/gtest.h>
#include <pthread.h>

#include <atomic>
#include <cerrno>
#include <limits>
#include <stdexcept>
#include <thread>
#include <vector>

#include "base/threads.h"

namespace
{
std::atomic<int> threads_to_be_had{std::numeric_limits<int>::max()};
}

/// Takes the place of the system's, which has no limit that a test can set for root as well.
extern "C" int pthread_create(
    pthread_t* thread, const pthread_attr_t* attributes, void* (*start)(void*), void* argument) noexcept
{
	static const auto of_the_system = reinterpret_cast<decltype(&pthread_create)>(dlsym(RTLD_NEXT, "pthread_create"));
	return threads_to_be_had-- > 0 ? of_the_system(thread, attributes, start, argument) : EAGAIN;
}

namespace d2s1r::test
{
namespace
{
class Parallel : public testing::Test
{
   protected:
	~Parallel() override { threads_to_be_had = std::numeric_limits<int>::max(); }

	/// How often each of 100 jobs was called.
	static std::vector<int> calls(int threads)
	{
		std::vector<int> counts(100);
		parallel_for(counts.size(), threads, [&](std::size_t i) { counts[i]++; });
		return counts;
	}
};
}  // namespace

TEST_F(Parallel, DoesEveryJobOnce)
{
	for (const int threads : {-1, 0, 1, 2, 7, 200}) EXPECT_EQ(calls(threads), std::vector<int>(100, 1)) << threads;
	parallel_for(0, 4, [](std::size_t) { FAIL() << "there is no job"; });
}

TEST_F(Parallel, UsesTheThreadsItIsGiven)
{
	std::atomic<int> waiting{0};
	parallel_for(
	    3, 3,
	    [&](std::size_t)
	    {
		    waiting++;
		    while (waiting < 3) std::this_thread::yield();  // for ever, were these not three threads
	    });
	EXPECT_EQ(waiting, 3);
}

TEST_F(Parallel, GoesOnWithTheThreadsThatTheSystemGrants)
{
	for (const int granted : {0, 1, 2})
	{
		threads_to_be_had = granted;
		EXPECT_EQ(calls(8), std::vector<int>(100, 1)) << granted;
		EXPECT_LT(threads_to_be_had, 0) << "no thread was refused";
	}
}

TEST_F(Parallel, RethrowsAndLeavesOutWhatHasNotStarted)
{
	std::atomic<int> started{0};
	const auto fail = [&](std::size_t i)
	{
		started++;
		if (i == 5) throw std::runtime_error("job 5");
	};
	EXPECT_THROW(parallel_for(100, 1, fail), std::runtime_error);
	EXPECT_EQ(started, 6);
	EXPECT_THROW(parallel_for(100000, 3, fail), std::runtime_error);
}
}  // namespace d2s1r::test
