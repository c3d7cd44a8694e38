// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "ros/frame_tree.h"

#include <algorithm>
#include <deque>

namespace d2s1r::logs
{
namespace
{
constexpr std::size_t kMostTransforms = 10000;  // [-] bounds the memory; robots have less than a hundred
}

void FrameTree::add(const Transform& transform)
{
	const auto& parent = transform.header.frame;
	const auto& child = transform.child;
	if (!transform.pose || parent == child) return;
	const auto found = poses_.find({parent, child});
	if (found != poses_.end())
		found->second = *transform.pose;
	else if (poses_.size() < kMostTransforms)
	{
		poses_.emplace(std::pair{parent, child}, *transform.pose);
		neighbours_[parent].push_back(child);
		neighbours_[child].push_back(parent);
		parents_.emplace(child, parent);
	}
}

std::optional<mrpt::poses::CPose3D> FrameTree::pose_in(const std::string& frame, const std::string& other) const
{
	std::map<std::string, mrpt::poses::CPose3D> reached = {{other, {}}};  // poses in `other`
	std::deque<std::string> next = {other};
	for (; !next.empty() && reached.count(frame) == 0; next.pop_front())
	{
		const auto neighbours = neighbours_.find(next.front());
		if (neighbours == neighbours_.end()) continue;
		const auto& here = reached.at(next.front());
		for (const auto& neighbour : neighbours->second)
		{
			if (reached.count(neighbour) > 0) continue;
			const auto down = poses_.find({next.front(), neighbour});
			const auto step = down != poses_.end() ? down->second : -poses_.at({neighbour, next.front()});
			reached.emplace(neighbour, here + step);
			next.push_back(neighbour);
		}
	}
	const auto found = reached.find(frame);
	if (found == reached.end()) return std::nullopt;
	return found->second;
}

std::vector<std::string> FrameTree::ancestors(const std::string& frame) const
{
	std::vector<std::string> found;
	for (auto at = parents_.find(frame); at != parents_.end(); at = parents_.find(at->second))
	{
		if (std::find(found.begin(), found.end(), at->second) != found.end()) break;  // a circle, which tf forbids
		found.push_back(at->second);
	}
	return found;
}
}  // namespace d2s1r::logs
