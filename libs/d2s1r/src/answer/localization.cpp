// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Core>
#include <d2s1r/localization.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace d2s1r
{
const char* to_string(Status status)
{
	switch (status)
	{
		case Status::kLocalized:
			return "localized";
		case Status::kAmbiguous:
			return "ambiguous";
		case Status::kRejected:
			return "rejected";
		case Status::kInvalid:
			break;
	}
	return "invalid";
}

void check(const Hypothesis& hypothesis)
{
	const auto& pose = hypothesis.pose;
	const auto& covariance = hypothesis.covariance;
	const double sum = pose.x() + pose.y() + pose.phi() + covariance.sum() + hypothesis.log_likelihood.value_or(0) +
	                   hypothesis.by_pieces.value_or(0) + hypothesis.explained.value_or(0) +
	                   hypothesis.log_odds.value_or(0);
	if (!std::isfinite(sum))
		throw std::invalid_argument("a hypothesis holds a number that is not finite; pass what localize() answered");
	if (covariance(0, 0) < 0 || covariance(1, 1) < 0 || covariance(2, 2) < 0)
		throw std::invalid_argument("a hypothesis has a negative variance; pass what localize() answered");
	constexpr double kRounding = 1e-6;
	if (!(hypothesis.probability >= 0 && hypothesis.probability <= 1 + kRounding))
		throw std::invalid_argument("the probability of a hypothesis is not in [0, 1]; pass what localize() answered");
}

Hypothesis hypothesis_of_sensor(
    const mrpt::math::TPose2D& sensor, const mrpt::math::CMatrixDouble33& covariance,
    const mrpt::math::TPose2D& sensor_on_robot)
{
	const mrpt::math::TPose2D robot = sensor + (mrpt::math::TPose2D() - sensor_on_robot);
	auto jacobian = mrpt::math::CMatrixDouble33::Identity();
	jacobian(0, 2) = -(robot.y - sensor.y);
	jacobian(1, 2) = robot.x - sensor.x;
	Hypothesis hypothesis;
	hypothesis.pose = mrpt::poses::CPose2D(robot);
	hypothesis.covariance = jacobian.asEigen() * covariance.asEigen() * jacobian.asEigen().transpose();
	return hypothesis;
}

const Hypothesis& Localization::best() const
{
	if (hypotheses.empty())
		throw std::logic_error("Localization::best(): no hypothesis, status " + std::string(to_string(status)));
	return hypotheses.front();
}

Localization no_place(Status status, const std::string& note)
{
	Localization result;
	result.status = status;
	result.note = note;
	return result;
}

mrpt::poses::CPosePDFSOG Localization::as_sog() const
{
	mrpt::poses::CPosePDFSOG sog(hypotheses.size());
	for (std::size_t i = 0; i < hypotheses.size(); i++)
	{
		auto& mode = sog.get(i);
		mode.mean = hypotheses[i].pose;
		mode.cov = hypotheses[i].covariance;
		// MRPT subtracts log weights: they must be finite, even where a probability has underflowed
		mode.log_w = std::log(std::max(hypotheses[i].probability, std::numeric_limits<double>::min()));
	}
	return sog;
}
}  // namespace d2s1r
