// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "parallel.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace d2s1r::app
{
void run_parallel(int threads, std::size_t jobs, const std::function<void(std::size_t)>& job)
{
	std::atomic<std::size_t> next{0};
	std::mutex mutex;
	std::exception_ptr failure;
	const auto work = [&]
	{
		try
		{
			for (std::size_t i = next++; i < jobs; i = next++) job(i);
		}
		catch (...)
		{
			next = jobs;
			const std::lock_guard<std::mutex> lock(mutex);
			if (!failure) failure = std::current_exception();
		}
	};
	const std::size_t helpers =
	    std::min(static_cast<std::size_t>(std::max(threads, 1)), std::max<std::size_t>(jobs, 1)) - 1;
	std::vector<std::thread> pool;
	for (std::size_t i = 0; i < helpers; i++) pool.emplace_back(work);
	work();
	for (auto& thread : pool) thread.join();
	if (failure) std::rethrow_exception(failure);
}
}  // namespace d2s1r::app
