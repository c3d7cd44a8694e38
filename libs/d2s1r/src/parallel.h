// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <thread>
#include <vector>

namespace d2s1r
{
/// Calls `work(i)` for every i below `count`, on up to `threads` threads, in any order. Rethrows what `work` throws.
template <class Work>
void parallel_for(std::size_t count, int threads, const Work& work)
{
	std::atomic<std::size_t> next{0};
	std::exception_ptr failure;
	std::atomic_flag failed = ATOMIC_FLAG_INIT;
	const auto run = [&]
	{
		try
		{
			for (std::size_t i = next++; i < count; i = next++) work(i);
		}
		catch (...)
		{
			if (!failed.test_and_set()) failure = std::current_exception();
			next = count;
		}
	};
	std::vector<std::thread> others;
	for (std::size_t i = 1; i < std::min(static_cast<std::size_t>(std::max(threads, 1)), count); i++)
		others.emplace_back(run);
	run();
	for (std::thread& other : others) other.join();
	if (failure) std::rethrow_exception(failure);
}
}  // namespace d2s1r
