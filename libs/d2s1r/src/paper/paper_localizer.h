// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "answer/localization_method.h"
#include "paper/signature_index.h"
#include "paper/yaw_registration.h"

namespace d2s1r
{
/// Answers where `scan` was taken by the published method: it finds the k cells of nearest signature and registers the
/// scan to each of them by relative entropy (Wang et al., "Global Localization With a Single-Line LiDAR by Dense 2D
/// Signature and 1D Registration", IEEE Sensors Journal 21(10), 2021, Fig. 1).
///
/// It always answers with its best candidate, and the status is localized. All candidates are returned, by increasing
/// relative entropy D. The paper knows no probabilities; here they are proportional to 2^(-n D) for n effectively
/// independent beams (Sanov's theorem), and the confidence is the sum over the candidates at the place of the best one.
/// Covariances come from the size of a cell and the step of the yaw.
///
/// Where the paper leaves a choice, or contradicts itself:
/// - In the paper a range of zero is the least one, and one of infinity is out of range. Logs write 0 for "nothing in
///   range", and paper.ini takes it for that (scan.zero_is_no_return); the default, which takes it for no data, finds
///   72 % instead of 98 % of the scans of mit_killian (sim360_off). Beams without data leave holes in the window that
///   is compared.
/// - The nearest signatures are exact, not approximate ones (see signature_index.cpp), and the bin beyond the last of
///   Algorithm 1 is the last one. A bin of a signature counts 255 rays at most, so that a count is a byte. Bins are (r
///   + epsilon) / d wide, not 0.05 m as in Table II, which 60 bins cannot be.
/// - Signatures come from a sweep along digital lines, the virtual scans that are registered from exact rays.
/// - Algorithm 2 steps before its first comparison; here the first shift is 0. Scans are resampled, then normalized,
///   and counter-clockwise, as MRPT's.
/// - Cells are those of the map: Table II's 0.05 m is not forced on it. Rays pass unknown space.
///
/// It is thread-safe. A thread's first call aside, nothing but the returned hypotheses is allocated.
/// \param scan a valid one
/// \param caster casts rays in `grid`, up to the range of `parameters`
/// \param stop null, or asked for each cell: if it returns true, the remaining ones are left out
Localization localize_paper(
    const Scan& scan, const Grid& grid, const SignatureIndex& index, const RayCaster& caster,
    const PaperParameters& parameters, const std::function<bool()>& stop = {});

/// Returns the relative entropy D(observed || virtual) [bit], Eq. 1, of a scan and a virtual scan of a sensor at
/// `sensor` (in map, m and rad); lower is better. Thread-safe.
/// \return no value if no beam can be compared
std::optional<double> relative_entropy_at(
    const mrpt::math::TPose2D& sensor, const Scan& scan, const RayCaster& caster, const PaperParameters& parameters);

/// The published method in one map.
class PaperLocalizer : public LocalizationMethod
{
   public:
	/// Builds the index.
	/// \param threads [-] that build it
	/// \throws std::invalid_argument if a sensor can stand nowhere, or paper.max_range is more than can be swept
	PaperLocalizer(const Grid& grid, const Parameters& parameters, int threads);
	explicit PaperLocalizer(IndexReader& file);

	/// \throws std::invalid_argument if there is a prior: the method searches everywhere
	Localization localize(const Scan& scan, const Query& query, const Parameters& parameters) const override;
	/// \throws std::invalid_argument the method has no hypothesis without a search
	Localization look_at(
	    const Scan& scan, const std::vector<mrpt::math::TPose2D>& robots, const Prior& prior,
	    const Parameters& parameters) const override;
	const RayCaster& caster() const override { return caster_; }
	void save(IndexWriter& file) const override;

   private:
	Grid grid_;  //!< without its cells
	RayCaster caster_;
	SignatureIndex index_;
};

/// Returns about how much memory [byte] it takes to build the index of a PaperLocalizer, beside the grid.
double memory_of_paper_index(const Grid& grid, const PaperParameters& parameters);
}  // namespace d2s1r
