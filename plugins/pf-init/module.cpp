// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// What loading libd2s1r-pf-init.so registers with MRPT.
#include <mrpt/core/initializer.h>

#include "CParticleFilterFusion.h"

// A linker with --as-needed drops a library of which no symbol is used, and its registrations with it.
MRPT_INITIALIZER(register_d2s1r_pf_init)
{
	mrpt::rtti::registerClass(CLASS_ID(d2s1r::CSignatureMap2D));
	mrpt::rtti::registerClass(CLASS_ID(d2s1r::CParticleFilterFusion));
}
