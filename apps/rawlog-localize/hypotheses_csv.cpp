// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "hypotheses_csv.h"

#include <cmath>

namespace d2s1r::app
{
HypothesesCsv::HypothesesCsv(const std::string& path) : file_(path)
{
	file_.print("frame,rank,x,y,phi,probability,std_x,std_y,std_phi\n");
}

void HypothesesCsv::add(const Frame& frame)
{
	int rank = 0;
	for (const auto& h : frame.result.hypotheses)
		file_.print(
		    "%zu,%d,%.6f,%.6f,%.6f,%.6g,%.6f,%.6f,%.6f\n", frame.index, ++rank, h.pose.x(), h.pose.y(), h.pose.phi(),
		    h.probability, std::sqrt(h.covariance(0, 0)), std::sqrt(h.covariance(1, 1)), std::sqrt(h.covariance(2, 2)));
}
}  // namespace d2s1r::app
