// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/localization.h>
#include <mrpt/poses/CPosePDFGaussian.h>

#include <optional>

namespace d2s1r
{
/// Returns the motion from one hypothesis to another, in the robot frame of `from`, m and rad, with the uncertainty of
/// both ends.
mrpt::poses::CPosePDFGaussian increment_between(const Hypothesis& from, const Hypothesis& to);

/// Returns the covariance of (x, y, phi), m^2 and rad^2, whose errors are independent of each other.
/// \param std_x, std_y [m] standard deviations
/// \param std_phi [rad] standard deviation
mrpt::math::CMatrixDouble33 covariance_of(double std_x, double std_y, double std_phi);

/// Squared Mahalanobis distance between two estimates of one motion that 1 of 1,000 exceeds (chi-squared, 3 degrees of
/// freedom). Beyond, one of them is wrong.
inline constexpr double kMostOff = 16.27;  //!< [-]

/// Holds what is expected of odometry and of the motion of a robot. Applications do not set it.
struct OdometryTuning
{
	double least_error = 0.05;  //!< [m] standard deviation of an increment, however short
	double least_turn = 2;      //!< [deg] standard deviation of its turn, however short
	double error_share = 0.1;   //!< [-] of what the robot went and turned: is added to these
	double turn_by_way = 5;     //!< [deg/m] is added to that of the turn

	double newest = 0.1;            //!< [0, 1] share of the newest scan in averages: the disagreement of OdometryCheck,
	                                //!< and how probably the map explains the last scans
	double most_disagreement = 10;  //!< [-] average of an odometry that can be relied on; one motion alone adds
	                                //!< half of it at most

	double widest_turn = 50;  //!< [deg] of a robot from one scan to the next that nobody measured; beyond, it is a
	                          //!< jump, for rooms look alike the other way round
};

/// Returns an increment of odometry, in the robot frame at its start, with the errors that wheels make: they grow with
/// the way and with the turn.
mrpt::poses::CPosePDFGaussian odometry_motion(const mrpt::poses::CPose2D& increment, const OdometryTuning& tuning = {});

/// Returns how far apart two independent estimates of one pose or motion are, (x, y, phi), m and rad.
/// \return [standard deviations]
double mahalanobis_distance(
    mrpt::poses::CPosePDFGaussian a /* MRPT's method is not const */, const mrpt::poses::CPosePDFGaussian& b);

/// Returns the product of two independent estimates of the same pose or motion, (x, y, phi), m and rad.
mrpt::poses::CPosePDFGaussian combine(const mrpt::poses::CPosePDFGaussian& a, const mrpt::poses::CPosePDFGaussian& b);

/// Holds the errors of an odometry as localized scans show them.
struct OdometryEstimate
{
	double scale = 1;          //!< [-] number that its ways have to be multiplied by
	double scale_std = 0.2;    //!< [-] standard deviation of that
	double way_noise = 1;      //!< [-] its errors of ways against those of odometry_motion(), at least 1
	double turn_noise = 1;     //!< [-] its errors of turns against those of odometry_motion(), at least 1
	std::size_t motions = 0;   //!< [-] between localized scans, from which this is known
	bool is_relied_on = true;  //!< whether scans do not contradict it
};

/// Compares odometry with the motions between localized scans. It estimates the scale of the odometry and how large its
/// errors are, and it recognizes an odometry that cannot be relied on: one that is frozen contradicts scan after scan.
/// Use one object per robot; it is not thread-safe.
class OdometryCheck
{
   public:
	/// Relies on odometry from the first motion on.
	explicit OdometryCheck(const OdometryTuning& tuning = {}) : tuning_(tuning) {}

	/// Takes in the next scan; call it for every one.
	/// \param increment since the scan before, robot frame then
	/// \param localization of this scan alone
	/// \return the motion of the robot, by the estimated scale and with errors of the estimated size, if the odometry
	/// can be relied on: it is plausible, and scans do not contradict the last increments
	std::optional<mrpt::poses::CPosePDFGaussian> checked(
	    const std::optional<mrpt::poses::CPose2D>& increment, const Localization& localization);

	/// Returns the motion of a robot whose odometry measured this increment, by the estimated scale and with errors of
	/// the estimated size; no value if the increment is not plausible or the odometry cannot be relied on.
	std::optional<mrpt::poses::CPosePDFGaussian> motion(const mrpt::poses::CPose2D& increment) const;

	/// Returns what is known after the last scan.
	const OdometryEstimate& estimate() const { return estimate_; }

   private:
	mrpt::poses::CPosePDFGaussian corrected(const mrpt::poses::CPose2D& increment) const;
	void learn(const mrpt::poses::CPose2D& increment, const mrpt::poses::CPosePDFGaussian& seen);

	OdometryTuning tuning_;
	OdometryEstimate estimate_;
	std::optional<Hypothesis> before_;  //!< of the scan before, if that was localized
	// Averages of the last motions, each a square in units of the variance that is expected.
	double disagreement_ = 0;  //!< [-] squared Mahalanobis distance
	double way_error_ = 2;     //!< [-] of both coordinates of the way
	double turn_error_ = 1;    //!< [-]
};
}  // namespace d2s1r
