// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <hwy/highway.h>

#include <cstdint>
#include <vector>

namespace d2s1r::test
{
/// While it lives, the library runs the loops of one target of Highway.
class ChosenSimd
{
   public:
	explicit ChosenSimd(std::int64_t target) { hwy::GetChosenTarget().Update(target); }
	~ChosenSimd() { hwy::GetChosenTarget().DeInit(); }
	ChosenSimd(const ChosenSimd&) = delete;
	ChosenSimd& operator=(const ChosenSimd&) = delete;
};

/// While it lives, the library runs its portable loops instead of the machine's SIMD instructions.
class PortableSimd : ChosenSimd
{
   public:
	PortableSimd() : ChosenSimd(0) {}
};

/// Targets this machine runs; those that the library was not compiled for stand for its portable loops.
inline std::vector<std::int64_t> simd_targets()
{
	std::vector<std::int64_t> targets;
	for (std::int64_t left = hwy::SupportedTargets(); left != 0; left &= left - 1) targets.push_back(left & -left);
	return targets;
}
}  // namespace d2s1r::test
