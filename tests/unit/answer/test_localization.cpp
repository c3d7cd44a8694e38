// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/localization.h>
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

namespace
{
d2s1r::Localization two_places()
{
	d2s1r::Localization result;
	result.status = d2s1r::Status::kAmbiguous;
	for (const double probability : {0.7, 0.2, 0.0})
	{
		d2s1r::Hypothesis hypothesis;
		hypothesis.pose = {10 * probability, -1, 2};
		hypothesis.covariance.setIdentity();
		hypothesis.covariance(0, 2) = hypothesis.covariance(2, 0) = 0.1 * probability;
		hypothesis.probability = probability;
		result.hypotheses.push_back(hypothesis);
	}
	return result;
}

TEST(Localization, AsSogKeepsEveryHypothesis)
{
	const auto result = two_places();
	const auto sog = result.as_sog();
	ASSERT_EQ(sog.size(), 3U);
	for (std::size_t i = 0; i < sog.size(); i++)
	{
		EXPECT_EQ(sog[i].mean, result.hypotheses[i].pose);
		EXPECT_EQ(sog[i].cov, result.hypotheses[i].covariance);
		EXPECT_NEAR(std::exp(sog[i].log_w), result.hypotheses[i].probability, 1e-12);
		EXPECT_TRUE(std::isfinite(sog[i].log_w));
	}
	EXPECT_TRUE(d2s1r::Localization{}.as_sog().empty());
}

TEST(Localization, BestIsTheFirstHypothesisOrAnError)
{
	EXPECT_EQ(two_places().best().probability, 0.7);
	EXPECT_THROW(d2s1r::Localization{}.best(), std::logic_error);
}

TEST(Localization, StatusesHaveTheNamesOfTheOutputs)
{
	EXPECT_STREQ(d2s1r::to_string(d2s1r::Status::kLocalized), "localized");
	EXPECT_STREQ(d2s1r::to_string(d2s1r::Status::kAmbiguous), "ambiguous");
	EXPECT_STREQ(d2s1r::to_string(d2s1r::Status::kRejected), "rejected");
	EXPECT_STREQ(d2s1r::to_string(d2s1r::Status::kInvalid), "invalid");
}
}  // namespace
