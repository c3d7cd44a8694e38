// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// The least-squares problem of a drive: how far its returns are from the walls, and its motions from those of the
// odometry, by how the laser is read and where it was.
#pragma once

#include <Eigen/Core>
#include <d2s1r/calibration.h>

#include <array>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "calibration/wall_field.h"

namespace d2s1r::calibration
{
constexpr std::size_t kGlobals = kUnknowns + 1;  // the last one is how far [m] all returns end before the walls
constexpr double kDegree = M_PI / 180;

/// Returns one of the numbers of a reading, see Unknown.
double& value_in(Reading& reading, std::size_t unknown);

/// Returns what messages say of an unknown of a reading. A sweep that goes the other way than they say starts with the
/// beam that they call the first.
double told_value(const Reading& told, const Reading& reading, std::size_t unknown);

/// Returns a - b of an unknown, of angles that below a half turn.
double difference(std::size_t unknown, double a, double b);

/// Returns a motion of the odometry as a reading has it.
mrpt::math::TPose2D as_read(const Reading& reading, const mrpt::math::TPose2D& recorded);

/// Tells where the robot was by its odometry.
class Track
{
   public:
	/// \param poses which must live as long
	explicit Track(const std::vector<TimedPose>& poses);

	/// Returns the pose at a time [s] by the odometry's clock; no value long before the first pose or after the last
	/// one.
	std::optional<mrpt::math::TPose2D> at(double time) const;

	/// A motion as the odometry has it, and what it covered to and fro, which its error grows with.
	struct Recorded
	{
		mrpt::math::TPose2D moved;
		double way = 0, turn = 0;  //!< [m], [rad]
	};

	/// Returns how the robot moved from one time [s] to another by the clock of the scans, as the odometry has it, and
	/// as a reading has it.
	std::optional<Recorded> recorded_motion(const Reading& reading, double from, double to) const;
	std::optional<mrpt::math::TPose2D> motion(const Reading& reading, double from, double to) const;

	/// Returns the same of the laser; none where there is no odometry.
	mrpt::math::TPose2D motion_of_laser(const Reading& reading, double from, double to) const;

   private:
	/// Returns what was covered since the first pose.
	Eigen::Vector2d covered(double time) const;

	const std::vector<TimedPose>& poses_;
	std::vector<Eigen::Vector2d> covered_;  //!< [m], [rad] since the first pose, at each
};

/// Holds what is sought: a reading, where the laser was in the map in the middle of each scan, and how far returns end
/// before the walls.
struct State
{
	Reading reading;
	std::vector<mrpt::math::TPose2D> lasers;
	double offset = 0;  //!< [m]
};

/// Standard deviations of what is measured. Those of the odometry are learned from the drive.
struct Noise
{
	double wall = 0.03;               //!< [m]
	double independent_returns = 25;  //!< [-] of a scan, whose neighbours hit the same wall
	double way = 1, turn = 1;         //!< [-] factors of the odometry's errors
	double kernel = 1;                //!< [-] how much wider the robust kernel is than in the end
};

/// Where a scan fits best.
struct Settled
{
	mrpt::math::TPose2D laser;
	double explained = 0;  //!< [0, 1] share of its returns that end at walls
};

/// The sums of a step of Gauss-Newton: of the globals, then of each pose.
struct Normal
{
	Eigen::MatrixXd matrix;
	Eigen::VectorXd gradient;
	Eigen::MatrixXd groups;  //!< a column of the gradient for each scan and each motion
	double cost = 0;         //!< [nat]

	/// Returns x with (matrix + damping * its diagonal) x = right.
	Eigen::MatrixXd solve(const Eigen::MatrixXd& right, double damping) const;
};

/// Returns by how many standard deviations a motion of the laser differs from that of the odometry: along the way of
/// the robot, across it, and in its turn. \param recorded motion of the robot
/// \param of_poses [m] [rad] error of the poses, beside that of the odometry
Eigen::Vector3d motion_error(
    const Noise& noise, const Reading& reading, const Track::Recorded& recorded, const mrpt::math::TPose2D& from,
    const mrpt::math::TPose2D& to, double of_poses);

/// Returns whether scan k is followed by another one before odometry has gone astray.
bool is_motion(const std::vector<FoundScan>& scans, std::size_t k);

/// Returns cost [nat] and weight of a residual by the kernel of Geman and McClure.
/// \param square [-] of the residual over its standard deviation \param bound [-] the same where it loses its force
std::pair<double, double> robust(double square, double bound);

/// Tells the residuals of a drive, by what is sought.
class Problem
{
   public:
	/// \param map, scans, track which must live as long
	Problem(const Grid& map, const Reading& told, const std::vector<FoundScan>& scans, const Track& track)
	    : walls_(map), told_(told), scans_(scans), track_(track)
	{
	}

	/// Says which unknowns are sought; the others stay as they are told.
	std::array<bool, kUnknowns> is_free{};
	Noise noise;

	const Reading& told() const { return told_; }
	const std::vector<FoundScan>& found() const { return scans_; }
	const Track& track() const { return track_; }
	std::size_t scans() const { return scans_.size(); }

	/// Returns a reading, and the scans as they were found, which was with the reading of the messages.
	State start(const Reading& reading) const;

	Normal normal(const State& state);

	/// Improves a state by the method of Levenberg and Marquardt. Returns its cost [nat].
	double improve(State& state, int steps);

	/// Returns where the laser was in the middle of scan k, if it was about there, as messages say how it is read.
	Settled settle(mrpt::math::TPose2D laser, std::size_t k);

	bool is_motion(std::size_t k) const { return calibration::is_motion(scans_, k); }

	/// Returns the error of motion k between scans, see above; no value where there is no odometry.
	std::optional<Eigen::Vector3d> motion_error(const State& state, std::size_t k, double of_poses = 0) const;

	/// Returns motion k of the laser between scans, as found, minus that by the odometry; no value without odometry.
	std::optional<mrpt::math::TPose2D> motion_off(const State& state, std::size_t k) const;

	/// Says where a return is, in the frame of the laser in the middle of the scan.
	struct Point
	{
		Eigen::Vector2d at;                      //!< [m]
		Eigen::Matrix<double, 2, 3> derivative;  //!< by duration, angle scale and range factor
	};
	std::vector<Point> points(const Reading& reading, std::size_t k) const;

	/// Returns the distance of a point, in the frame of the laser, from the walls, and its gradient in the map.
	WallDistance wall_at(const mrpt::math::TPose2D& laser, const Eigen::Vector2d& point);

   private:
	/// The sums of the returns of a scan: of its pose, of the unknowns of Point, and of State::offset.
	struct WallSums
	{
		Eigen::Matrix<double, 7, 7> matrix = Eigen::Matrix<double, 7, 7>::Zero();
		Eigen::Matrix<double, 7, 1> gradient = Eigen::Matrix<double, 7, 1>::Zero();
		double cost = 0, explained = 0;  //!< [nat], [-] share of the returns that end at walls
	};

	/// \param bound [standard deviations] of a return
	WallSums wall_sums(const mrpt::math::TPose2D& laser, const std::vector<Point>& seen, double offset, double bound);
	State moved(State state, const Eigen::VectorXd& step) const;
	void add_walls(const State& state, std::size_t k, Normal& sums);
	void add_motion(const State& state, std::size_t k, Normal& sums) const;

	WallField walls_;
	const Reading& told_;
	const std::vector<FoundScan>& scans_;
	const Track& track_;
};

/// What is known of an unknown before the drive, and what matters of it.
struct Scale
{
	double before;   //!< standard deviation before the drive
	double told;     //!< standard deviation below which the drive tells it
	double matters;  //!< least difference from the messages that is worth a change
	double rare;     //!< [nat] by which messages are wrong about it more rarely than about others
};
// Units of Unknown. Chosen by hand: standard deviations before the drive cover the faults that people report;
// differences that matter are above what the maps and wheels of recorded drives (experiments/RESULTS.md) seem to be
// off.
constexpr std::array<Scale, kUnknowns> kScales = {
    {{M_PI, 3 * kDegree, 3 * kDegree, 0},
     {0.3, 0.05, 0.15, 0},
     {0.3, 0.05, 0.15, 0},
     {0.15, 0.03, 0.04, 0},
     {0.15, 0.03, 0.04, 0},
     {0.05, 0.01, 0.025, 5},
     {0.05, 0.01, 0.03, 0},
     {0.2, 0.1, HUGE_VAL, 0},
     {0.2, 0.1, HUGE_VAL, 0}}};
}  // namespace d2s1r::calibration
