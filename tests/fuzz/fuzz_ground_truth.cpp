// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Any text as a ground truth: refused with one line, or read as finite poses.
#include <shell/errors.h>

#include "evaluation/ground_truth.h"
#include "fuzz_input.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
	using namespace d2s1r;
	static const fuzz::CaseFile file("truth.txt");
	try
	{
		const app::GroundTruth truth = app::load_ground_truth(file.write(data, size));
		fuzz::require(!truth.empty(), "poses in a ground truth that is accepted");
		for (const TimedPose& pose : truth)
			for (const double number : {pose.time, pose.robot.x, pose.robot.y, pose.robot.phi})
				fuzz::require(std::isfinite(number), "finite poses of a ground truth");
	}
	catch (const app::UserError& error)
	{
		fuzz::require_one_line(error.what());
		fuzz::require(error.status == app::kBadInput, "exit status of a bad input");
	}
	return 0;
}
