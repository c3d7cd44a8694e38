// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The room that tests of CSignatureMap2D are about.
#pragma once

#include <d2s1r/CSignatureMap2D.h>

#include "mrpt_types.h"

namespace d2s1r::test
{
inline const Grid kGrid = make_picture_grid(
    enlarge(
        {"##############",  //
         "#............#",  //
         "#............#",  //
         "#....##......#",  //
         "#............#",  //
         "#............#",  //
         "##############"},
        5),
    0.1);
inline const mrpt::math::TPose2D kTruth = {2.3, 1.2, 0.4};  // robot in map

inline CSignatureMap2D make_signature_map()
{
	return CSignatureMap2D(*make_mrpt_map(kGrid));
}
}  // namespace d2s1r::test
