// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <hwy/highway.h>

namespace d2s1r::test
{
/// While it lives, the library runs its portable loops instead of the machine's SIMD instructions.
class PortableSimd
{
   public:
	PortableSimd() { hwy::GetChosenTarget().Update(0); }
	~PortableSimd() { hwy::GetChosenTarget().DeInit(); }
	PortableSimd(const PortableSimd&) = delete;
	PortableSimd& operator=(const PortableSimd&) = delete;
};
}  // namespace d2s1r::test
