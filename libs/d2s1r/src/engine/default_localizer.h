// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "answer/localization_method.h"
#include "engine/default_index.h"
#include "fine/decision.h"

namespace d2s1r
{
/// Returns the answer about a scan that is not looked for, because it is not valid or the sensor is covered; no value
/// about all others.
std::optional<Localization> refusal_of(const Scan& scan, const ScanParameters& parameters);

/// Answers in which of `maps`, and where there, `scan` was taken, by the default method, which works for any field of
/// view: CoarseSearch, settle(), make_shortlist(), refine(), find_places() and decide(). All maps go through these
/// steps together, as if they were one map. A first look judges some of the candidates, and a second one the others,
/// unless the first answer is clear and those left out cost far more. The places of both compete. Before an answer is
/// localized, places that equal it cell for cell, and that the search may have left out, compete as well. Thread-safe.
/// \param scan one without a refusal_of()
/// \param maps one or more; the parameters of the first one limit what is searched in all of them together
/// \param query its prior is not used: each map has its own
/// \return the answer without the relative entropy, and the number of the map of each hypothesis
Decision localize_default(const Scan& scan, const std::vector<SearchedMap>& maps, const Query& query);

/// The default method in one map.
class DefaultLocalizer : public LocalizationMethod
{
   public:
	/// Builds the index. See make_default_index().
	DefaultLocalizer(Grid grid, const Parameters& parameters)
	    : DefaultLocalizer(make_default_index(std::move(grid), parameters), parameters)
	{
	}
	/// Reads what save() wrote.
	DefaultLocalizer(IndexReader& file, const Parameters& parameters)
	    : DefaultLocalizer(read_default_index(file), parameters)
	{
	}

	Localization localize(const Scan& scan, const Query& query, const Parameters& parameters) const override;
	Localization look_at(
	    const Scan& scan, const std::vector<mrpt::math::TPose2D>& robots, const Prior& prior,
	    const Parameters& parameters) const override;
	const RayCaster& caster() const override { return caster_; }
	void save(IndexWriter& file) const override { d2s1r::save(index_, file); }

	/// Returns the index, for a search in several maps.
	const DefaultIndex& index() const { return index_; }

   private:
	DefaultLocalizer(DefaultIndex index, const Parameters& parameters);

	DefaultIndex index_;
	RayCaster caster_;
};
}  // namespace d2s1r
