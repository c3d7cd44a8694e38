// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "base/threads.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <thread>
#include <vector>

namespace d2s1r
{
namespace
{
template <class Run>
std::vector<std::thread> start_threads(std::size_t count, const Run& run)
{
	std::vector<std::thread> threads;
	threads.reserve(count);
	try
	{
		while (threads.size() < count) threads.emplace_back(std::cref(run));
	}
	catch (const std::exception&)
	{
		// A limit of the system: the threads there are do the work.
	}
	return threads;
}
}  // namespace

void run_on_threads(int threads, const std::function<void()>& work)
{
	std::exception_ptr failure;
	std::atomic_flag failed = ATOMIC_FLAG_INIT;
	const auto run = [&]
	{
		try
		{
			work();
		}
		catch (...)
		{
			if (!failed.test_and_set()) failure = std::current_exception();
		}
	};
	std::vector<std::thread> others = start_threads(static_cast<std::size_t>(std::max(threads, 1)) - 1, run);
	run();
	for (std::thread& other : others) other.join();
	if (failure) std::rethrow_exception(failure);
}

void parallel_for(std::size_t count, int threads, const std::function<void(std::size_t)>& work)
{
	std::atomic<std::size_t> next{0};
	const auto run = [&]
	{
		try
		{
			for (std::size_t i = next++; i < count; i = next++) work(i);
		}
		catch (...)
		{
			next = count;
			throw;
		}
	};
	const auto useful = std::min(static_cast<std::size_t>(std::max(threads, 1)), std::max<std::size_t>(count, 1));
	run_on_threads(static_cast<int>(useful), run);
}
}  // namespace d2s1r
