// own_filter MAP RAWLOG: seeds a particle filter of MRPT with the first localized scan, and tracks the robot from
// there.
#include <d2s1r/CSignatureMap2D.h>
#include <d2s1r/map_io.h>
#include <d2s1r/seeding.h>
#include <mrpt/bayes/CParticleFilter.h>
#include <mrpt/maps/CMultiMetricMap.h>
#include <mrpt/obs/CActionCollection.h>
#include <mrpt/obs/CActionRobotMovement2D.h>
#include <mrpt/obs/CObservationOdometry.h>
#include <mrpt/obs/CRawlog.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/slam/CMonteCarloLocalization2D.h>

#include <iostream>
#include <vector>

using namespace mrpt::obs;

/// A scan, and where the odometry was then.
struct LoggedScan
{
	CObservation2DRangeScan::Ptr scan;
	mrpt::poses::CPose2D odometry;
};

/// Reads both kinds of rawlogs: observations, or actions and sensory frames.
std::vector<LoggedScan> load_scans(const std::string& file)
{
	CRawlog log;
	bool is_read = false;
	try
	{
		is_read = log.loadFromRawLogFile(file);
	}
	catch (const std::exception&)  // with a text that is about MRPT
	{
	}
	if (!is_read || log.size() == 0) throw std::runtime_error(file + ": cannot be read as a rawlog; check the path");
	std::vector<LoggedScan> scans;
	mrpt::poses::CPose2D odometry;
	const auto add = [&](const CObservation::Ptr& observation)
	{
		if (const auto wheels = std::dynamic_pointer_cast<CObservationOdometry>(observation))
			odometry = wheels->odometry;
		if (const auto scan = std::dynamic_pointer_cast<CObservation2DRangeScan>(observation))
			scans.push_back({scan, odometry});
	};
	for (std::size_t i = 0; i < log.size(); i++)
		if (log.getType(i) == CRawlog::etObservation)
			add(log.getAsObservation(i));
		else if (log.getType(i) == CRawlog::etSensoryFrame)
			for (const CObservation::Ptr& observation : *log.getAsObservations(i)) add(observation);
		else if (const auto motion = log.getAsAction(i)->getBestMovementEstimation())
			odometry = odometry + motion->poseChange->getMeanVal();
	return scans;
}

int main(int argc, char** argv)
try
{
	if (argc != 3) throw std::runtime_error("usage: own_filter MAP RAWLOG");
	const auto map = d2s1r::CSignatureMap2D::Create(*d2s1r::load_map(argv[1]));

	mrpt::slam::CMonteCarloLocalization2D filter;
	filter.options.metricMap = map;  // its likelihood weighs the particles
	mrpt::bayes::CParticleFilter steps;
	bool is_seeded = false;
	mrpt::poses::CPose2D odometry_then;
	for (const auto& [scan, odometry] : load_scans(argv[2]))
	{
		if (!is_seeded)
		{
			const d2s1r::Localization result = map->localizer().localize(d2s1r::scan_of(*scan));
			if (result.status != d2s1r::Status::kLocalized) continue;
			d2s1r::assign_particles(filter, d2s1r::seed_particles(map->localizer(), result));
			is_seeded = true;
		}
		else
		{
			CActionRobotMovement2D motion;
			motion.computeFromOdometry(odometry - odometry_then, {});
			CActionCollection action;
			action.insert(motion);
			CSensoryFrame frame;
			frame.insert(scan);
			steps.executeOn(filter, &action, &frame);
		}
		odometry_then = odometry;
		mrpt::poses::CPose2D mean;
		filter.getMean(mean);
		std::cout << std::fixed << mrpt::Clock::toDouble(scan->timestamp) << ' ' << mean << '\n';
	}
	if (!is_seeded) throw std::runtime_error(std::string(argv[2]) + ": no scan was localized in this map");
}
catch (const std::exception& error)
{
	std::cerr << error.what() << '\n';
	return 1;
}
