// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// To be included before Highway: portable loops and, on x86-64, AVX2 are compiled, and the machine chooses. On arm64 it
// is NEON: vectors of SVE have no size that a struct could hold.
#pragma once

#define HWY_DISABLED_TARGETS \
	(HWY_SSSE3 | HWY_SSE4 | HWY_AVX3 | HWY_AVX3_DL | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
