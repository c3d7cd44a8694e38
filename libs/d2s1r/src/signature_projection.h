// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <vector>

#include "signature_counts.h"

namespace d2s1r
{
inline constexpr int kProjectionSize = 8;

/// A signature on the axes that carry most of the variance.
using ProjectedSignature = std::array<float, kProjectionSize>;

/// Orthonormal projection on the principal axes of a map's signatures: never lengthens a distance.
class SignatureProjection
{
   public:
	/// \param counts of at least one cell
	explicit SignatureProjection(const SignatureCounts& counts);

	/// \param counts [rays] one per bin
	template <class Count>
	ProjectedSignature project(const Count* counts) const
	{
		ProjectedSignature projected{};
		for (std::size_t bin = 0; bin < axes_.size(); bin++)
			for (std::size_t i = 0; i < projected.size(); i++)
				projected[i] += static_cast<float>(counts[bin]) * axes_[bin][i];
		return projected;
	}

   private:
	std::vector<ProjectedSignature> axes_;  //!< by bin
};
}  // namespace d2s1r
