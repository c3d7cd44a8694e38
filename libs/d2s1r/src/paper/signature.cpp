// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "paper/signature.h"

#include <algorithm>

namespace d2s1r
{
namespace
{
/// Counts ranges; the last bin holds what is out of range (Algorithm 1, lines 5, 6, 9 and 13).
class Histogram
{
   public:
	Histogram(const PaperParameters& parameters, Signature& counts)
	    : max_range_(parameters.max_range),
	      bin_width_((parameters.max_range + parameters.epsilon) / parameters.bins),
	      counts_(counts)
	{
		counts_.assign(static_cast<std::size_t>(parameters.bins), 0.0F);
	}
	void add(double range)
	{
		const auto bin = range < max_range_ ? static_cast<std::size_t>(range / bin_width_) : counts_.size();
		counts_[std::min(bin, counts_.size() - 1)] += 1;
		total_ += 1;
	}

	void add_out_of_range() { add(max_range_); }

	void normalize()
	{
		for (float& count : counts_) count /= std::max(total_, 1.0F);
	}

   private:
	double max_range_;  //!< [m]
	double bin_width_;  //!< [m]
	float total_ = 0;
	Signature& counts_;
};
}  // namespace

void make_signature(const Scan& scan, const PaperParameters& parameters, Signature& signature)
{
	Histogram histogram(parameters, signature);
	for (const Beam& beam : scan.beams)
		if (beam.is_return)
			histogram.add(static_cast<double>(beam.range));
		else
			histogram.add_out_of_range();
	histogram.normalize();
}

Signature make_signature(const Scan& scan, const PaperParameters& parameters)
{
	Signature signature;
	make_signature(scan, parameters, signature);
	return signature;
}

Signature make_signature(const std::vector<float>& ranges, const PaperParameters& parameters)
{
	Signature signature;
	Histogram histogram(parameters, signature);
	for (const float range : ranges) histogram.add(static_cast<double>(range));
	histogram.normalize();
	return signature;
}
}  // namespace d2s1r
