// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/localization.h>
#include <d2s1r/parameters.h>
#include <d2s1r/prior.h>
#include <d2s1r/scan.h>

#include <vector>

#include "base/index_file.h"
#include "ranges/ray_caster.h"

namespace d2s1r
{
/// Returns the answer of a search that was stopped: see Query.
inline Localization stopped_search()
{
	return no_place(Status::kRejected, "the search was stopped");
}

/// A method of localization and its index of a map, as a Localizer holds it: the default one or that of the paper. It
/// is const and thread-safe once it is built. Queries are answered by parameters that have the values the index was
/// built with, where it depends on them.
class LocalizationMethod
{
   public:
	LocalizationMethod() = default;
	virtual ~LocalizationMethod() = default;
	LocalizationMethod(const LocalizationMethod&) = delete;
	LocalizationMethod& operator=(const LocalizationMethod&) = delete;

	/// Answers where a scan was taken. The total time is not set; the relative entropy need not be.
	/// \throws std::invalid_argument if the query asks for what the method cannot do
	virtual Localization localize(const Scan& scan, const Query& query, const Parameters& parameters) const = 0;

	/// Judges a scan near these poses of the robot (map frame) alone, as localize() judges what it finds: it refines,
	/// scores and compares them, and searches nothing.
	/// \return the places that explain the scan best, however badly they do; none if the scan is not valid
	virtual Localization look_at(
	    const Scan& scan, const std::vector<mrpt::math::TPose2D>& robots, const Prior& prior,
	    const Parameters& parameters) const = 0;

	/// Returns what casts rays through the map, up to paper.max_range.
	virtual const RayCaster& caster() const = 0;

	virtual void save(IndexWriter& file) const = 0;
};
}  // namespace d2s1r
