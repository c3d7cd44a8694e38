// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/localizer.h>

#include <algorithm>
#include <string>
#include <vector>

#include "diagnosis/mistakes.h"

namespace d2s1r::app
{
struct Trial
{
	std::vector<Localization> answers;

	std::size_t count(Status status) const
	{
		const auto has_it = [&](const Localization& answer) { return answer.status == status; };
		return static_cast<std::size_t>(std::count_if(answers.begin(), answers.end(), has_it));
	}
	std::size_t fit() const { return count(Status::kLocalized); }
	/// Higher is better, also if no scan is localized.
	double score() const
	{
		double sum = 0;
		for (const Localization& answer : answers)
			if (!answer.hypotheses.empty()) sum += answer.confidence + answer.best().explained.value_or(0);
		return sum;
	}
};

class Tester
{
   public:
	/// \param of_run its index is used, with parameters for trials
	Tester(Samples samples, int threads, const Localizer& of_run);

	const Samples& samples() const { return samples_; }
	const Localizer& localizer() const { return localizer_; }

	/// Tries the scans, one in `step` of them.
	Trial try_scans(const Mistake& mistake, std::size_t step = 1, const Query& query = {}) const;

   private:
	Samples samples_;
	int threads_;
	Localizer localizer_;
};
}  // namespace d2s1r::app
