// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "ros/robot.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string_view>
#include <tuple>

namespace d2s1r::ros
{
namespace
{
constexpr std::size_t kLongestChain = 1000;          // [-] as tf2 has it
constexpr std::size_t kMostLinks = 10'000;           // [-] robots have less than a hundred; bounds memory and time
constexpr std::size_t kMostNamespaces = 30;          // [-] of topics of transforms
constexpr std::size_t kMostTopics = 250;             // [-] of lasers, and of odometry
constexpr std::size_t kMostFramesOfLasers = 10'000;  // [-] of all lasers
constexpr double kMountTravels = 1;                  // [m] farther than a laser's mount moves on a robot

bool are_the_same(const mrpt::poses::CPose3D& a, const mrpt::poses::CPose3D& b)
{
	constexpr double kLeastDistance = 1e-3, kLeastAngle = 1e-3;  // [m], [rad] far below what a scan shows
	if (a == b) return true;
	const auto difference = b - a;
	const double turned = std::acos(std::clamp((difference.getRotationMatrix().trace() - 1) / 2, -1.0, 1.0));
	return difference.norm() < kLeastDistance && turned < kLeastAngle;
}

/// The place of a topic among others; null if there are too many.
template <typename Topic>
Topic* find(const std::string& topic, std::vector<Topic>& topics, std::map<std::string, std::size_t>& places)
{
	const auto known = places.find(topic);
	if (known != places.end()) return &topics[known->second];
	if (topics.size() >= kMostTopics) return nullptr;
	places.emplace(topic, topics.size());
	topics.emplace_back().topic = topic;
	return &topics.back();
}

std::string_view last_part(std::string_view name)
{
	return name.substr(name.find_last_of('/') + 1);  // 0 if there is no slash
}

bool is_odometry_frame(std::string_view frame)
{
	return last_part(frame).find("odom") != std::string_view::npos;
}

bool is_of_world(std::string_view frame)
{
	const std::string_view name = last_part(frame);
	return name == "map" || name == "world" || name == "earth" || is_odometry_frame(name);
}

bool is_base(std::string_view frame)
{
	const std::string_view name = last_part(frame);
	return name == "base_link" || name == "base_footprint";
}

/// Whether a link leads from the robot into the world.
bool leaves_robot(const std::string& child, const Link& link)
{
	return link.travels || is_of_world(child) || is_of_world(link.parent);
}

bool is_in(std::string_view topic, std::string_view name_space)
{
	return topic.size() > name_space.size() && topic[name_space.size()] == '/' &&
	       topic.substr(0, name_space.size()) == name_space;
}

/// Whether a namespace of transforms that a laser is not in is that of another robot: a laser of the same name is in
/// it, or odometry is in the laser's own namespace and not in it.
bool is_of_other_robot(const std::string& name_space, const LaserTopic& laser, const RobotTopics& topics)
{
	if (name_space.empty() || is_in(laser.topic, name_space)) return false;
	const std::string own = laser.topic.substr(0, laser.topic.find('/', 1));
	const auto has_own = [&](const OdometryTopic& odometry) { return is_in(odometry.topic, own); };
	const auto is_like_it = [&, name = last_part(laser.topic)](const LaserTopic& other)
	{ return is_in(other.topic, name_space) && last_part(other.topic) == name; };
	return (!is_in(name_space + "/tf", own) &&
	        std::any_of(topics.odometries.begin(), topics.odometries.end(), has_own)) ||
	       std::any_of(topics.lasers.begin(), topics.lasers.end(), is_like_it);
}

/// The namespace of transforms that a laser belongs to: the longest that it is in and that knows a frame of it, else
/// the only one that does and is not of another robot; else the longest that it is in.
std::string find_namespace(const LaserTopic& laser, const RobotTopics& topics, AllLinks& links)
{
	std::vector<std::string> around, knowing;
	for (const auto& [name, unused] : topics.transforms)
	{
		const bool knows = std::any_of(
		    laser.frames.begin(), laser.frames.end(),
		    [&, &name = name](const auto& frame) { return links.of(name).knows(frame.first); });
		if (is_in(laser.topic, name)) around.push_back(name);
		if (knows) knowing.push_back(name);
	}
	const auto is_shorter = [](const std::string& a, const std::string& b) { return a.size() < b.size(); };
	std::vector<std::string> both;
	std::set_intersection(around.begin(), around.end(), knowing.begin(), knowing.end(), std::back_inserter(both));
	if (!both.empty()) return *std::max_element(both.begin(), both.end(), is_shorter);
	if (knowing.size() == 1 && !is_of_other_robot(knowing.front(), laser, topics)) return knowing.front();
	return around.empty() ? "" : *std::max_element(around.begin(), around.end(), is_shorter);
}

/// The frame of most of a laser's scans, of those that tf knows, if there are any.
std::string main_frame(const LaserTopic& laser, const LinksOfRobot& links)
{
	const auto rank = [&](const auto& frame) { return std::pair(links.knows(frame.first), frame.second); };
	const auto best = std::max_element(
	    laser.frames.begin(), laser.frames.end(), [&](const auto& a, const auto& b) { return rank(a) < rank(b); });
	return best == laser.frames.end() ? "" : best->first;
}

/// Whether odometry is in a namespace of transforms that a laser is not in.
bool is_in_other_namespace(const OdometryTopic& odometry, const LaserTopic& laser, const RobotTopics& topics)
{
	return std::any_of(
	    topics.transforms.begin(), topics.transforms.end(),
	    [&](const auto& links)
	    { return !links.first.empty() && is_in(odometry.topic, links.first) && !is_in(laser.topic, links.first); });
}

/// Whether odometry, of a frame that tf does not know, is one of several of the same name, and none of the laser's
/// namespace.
/// \param count how much odometry has a name, without the namespace
bool is_of_other_robot(
    const OdometryTopic& odometry, const LaserTopic& laser, const std::map<std::string_view, int>& count)
{
	const std::string own = namespace_of(odometry.topic);
	return !own.empty() && !is_in(laser.topic, own) && count.at(last_part(odometry.topic)) > 1;
}

/// Finds the topic of the robot's odometry: of its own, one that is about the robot's frame goes before others, then
/// one that is called odom, then one with more messages.
const OdometryTopic* find_odometry(
    const Robot& robot, const LaserTopic& laser, const std::set<std::string>& carriers, const RobotTopics& topics,
    const LinksOfRobot& links)
{
	std::map<std::string_view, int> count;
	for (const OdometryTopic& odometry : topics.odometries) count[last_part(odometry.topic)]++;
	const OdometryTopic* best = nullptr;
	const auto rank = [&](const OdometryTopic& o)
	{
		const bool is_about_robot = is_base(o.child) || carriers.count(o.child) > 0;
		return std::tuple(is_about_robot, last_part(o.topic) == "odom", o.messages);
	};
	for (const OdometryTopic& odometry : topics.odometries)
	{
		if (is_in_other_namespace(odometry, laser, topics)) continue;
		const bool is_known = links.knows(robot.laser_frame) && links.knows(odometry.child);
		if (is_known ? !links.are_on_one_robot(robot.laser_frame, odometry.child)
		             : is_of_other_robot(odometry, laser, count))
			continue;
		if (!best || rank(*best) < rank(odometry)) best = &odometry;
	}
	return best;
}

/// The frame of the robot without regard to odometry; empty if nothing carries the laser.
std::string find_base(const Robot& robot, const std::vector<std::string>& carriers, const LinksOfRobot& links)
{
	for (const char* name : {"base_link", "base_footprint"})
	{
		if (last_part(robot.laser_frame) == name) return robot.laser_frame;
		const auto carrier = std::find_if(
		    carriers.begin(), carriers.end(), [&](const std::string& frame) { return last_part(frame) == name; });
		if (carrier != carriers.end()) return *carrier;
		const auto all = links.named(name, robot.laser_frame);
		if (all.size() == 1) return all.front();
	}
	return carriers.empty() ? "" : carriers.back();
}
}  // namespace

Transform fixed_transform(const std::string& child, const Link& link)
{
	return {{0, link.parent}, child, link.last};
}

std::string namespace_of(const std::string& topic)
{
	const auto slash = topic.find_last_of('/');
	return slash == std::string::npos ? "" : topic.substr(0, slash);
}

LaserTopic* RobotTopics::laser(const std::string& topic)
{
	LaserTopic* const found = find(topic, lasers, laser_places_);
	is_complete = is_complete && found;
	return found;
}

OdometryTopic* RobotTopics::odometry(const std::string& topic)
{
	return find(topic, odometries, odometry_places_);
}

void RobotTopics::count(LaserTopic& laser, const std::string& frame)
{
	laser.messages++;
	const auto known = laser.frames.find(frame);
	if (known != laser.frames.end())
		known->second++;
	else if (frames_++ < kMostFramesOfLasers)
		changes++, laser.frames.emplace(frame, 1);
}

bool RobotTopics::has_room() const
{
	return links_ < kMostLinks && frames_ < kMostFramesOfLasers;
}

void RobotTopics::keep_only(const std::set<std::string>& frames)
{
	const auto keep = [&](auto& all)
	{
		for (auto at = all.begin(); at != all.end();) at = frames.count(at->first) > 0 ? std::next(at) : all.erase(at);
		return all.size();
	};
	links_ = frames_ = 0;
	for (auto& [name, links] : transforms) links_ += keep(links);
	for (LaserTopic& laser : lasers) frames_ += keep(laser.frames);
	changes++;
}

void RobotTopics::add_transforms(const std::string& topic, const std::vector<Transform>& all, bool are_static)
{
	const std::string name = namespace_of(topic);
	if (transforms.size() >= kMostNamespaces && transforms.count(name) == 0)
	{
		is_complete = false;
		return;
	}
	Links& links = transforms[name];
	for (const Transform& transform : all) add(transform, are_static, links);
}

void RobotTopics::add(const Transform& transform, bool is_static, Links& links)
{
	const std::string& parent = transform.header.frame;
	if (!transform.pose || parent.empty() || transform.child.empty() || parent == transform.child) return;
	auto known = links.find(transform.child);
	if (known == links.end())
	{
		is_complete = is_complete && links_ < kMostLinks;
		if (links_++ < kMostLinks) links.emplace(transform.child, Link{parent, *transform.pose, *transform.pose});
		changes++;
		return;
	}
	Link& link = known->second;
	const std::tuple before(link.parent, link.moves, link.travels);
	const bool is_other = link.parent != parent;
	if (is_static && !link.first_static && (is_other || !are_the_same(link.last, *transform.pose)))
		link.first_static = fixed_transform(known->first, link);
	link.last = *transform.pose;
	if (is_other) link.other_parent = link.parent;
	if (is_other || is_static) link.parent = parent, link.first = link.last;
	link.moves = link.moves || link.first_static || (is_other && !is_static) || !are_the_same(link.first, link.last);
	const double traveled = (link.last.m_coords - link.first.m_coords).norm();
	link.travels = link.travels || traveled > kMountTravels;
	if (before != std::tuple(link.parent, link.moves, link.travels)) changes++;
}

LinksOfRobot::LinksOfRobot(const RobotTopics& topics, const std::string& name_space)
{
	static const Links kNone;
	const auto find = [&](const std::string& name)
	{
		const auto links = topics.transforms.find(name);
		return links == topics.transforms.end() ? &kNone : &links->second;
	};
	own_ = find(name_space);
	shared_ = find("");
	connect(*own_);
	if (shared_ != own_) connect(*shared_);
}

const Link* LinksOfRobot::find(const std::string& frame) const
{
	for (const Links* links : {own_, shared_})
		if (const auto link = links->find(frame); link != links->end()) return &link->second;
	return nullptr;
}

void LinksOfRobot::connect(const Links& links)
{
	for (const auto& [child, link] : links)
	{
		for (const std::string_view frame : {std::string_view(child), std::string_view(link.parent)})
			if (parts_.emplace(frame, frame).second && is_base(frame)) bases_.push_back(frame);
		if (find(child) == &link && !leaves_robot(child, link)) parts_[root(child)] = root(link.parent);
	}
}

/// Shortens the way for the next time.
std::string_view LinksOfRobot::root(std::string_view frame) const
{
	auto at = parts_.find(frame);
	while (at->second != at->first)
	{
		const auto next = parts_.find(at->second);
		at->second = next->second;
		at = next;
	}
	return at->first;
}

std::string LinksOfRobot::meant_by(const std::string& frame) const
{
	for (auto end = frame.size(); end != std::string::npos && end > 0; end = frame.rfind('/', end - 1))
		for (std::size_t start = 0; start < end; start = frame.find('/', start) + 1)
		{
			if (knows(frame.substr(start, end - start)) && (start > 0 || end < frame.size()))
				return frame.substr(start, end - start);
			if (frame.find('/', start) >= end) break;
		}
	return "";
}

bool LinksOfRobot::are_on_one_robot(const std::string& a, const std::string& b) const
{
	return knows(a) && knows(b) && root(a) == root(b);
}

std::vector<std::string> LinksOfRobot::carriers(const std::string& frame) const
{
	std::vector<std::string> found = {frame};
	std::set<std::string> seen = {frame};
	while (found.size() <= kLongestChain)
	{
		const Link* const link = find(found.back());
		if (!link || leaves_robot(found.back(), *link) || !seen.insert(link->parent).second) break;
		found.push_back(link->parent);
	}
	found.erase(found.begin());
	return found;
}

std::vector<std::string> LinksOfRobot::ancestors(const std::string& frame) const
{
	std::vector<std::string> found;
	std::set<std::string> seen = {frame};
	for (const Link* link = find(frame); link && found.size() < kLongestChain; link = find(link->parent))
	{
		if (!seen.insert(link->parent).second) break;  // a circle, which tf forbids
		found.push_back(link->parent);
	}
	return found;
}

Path LinksOfRobot::climb(const std::string& frame, const std::string& ancestor) const
{
	Path path;
	for (std::string at = frame; at != ancestor;)
	{
		const Link& link = *find(at);
		path.pose = link.last + path.pose;
		path.moves = path.moves || link.moves;
		at = link.parent;
	}
	return path;
}

std::optional<Path> LinksOfRobot::path(const std::string& frame, const std::string& other) const
{
	const auto with_itself = [this](const std::string& first)
	{
		std::vector<std::string> above = ancestors(first);
		above.insert(above.begin(), first);
		return above;
	};
	const auto above = with_itself(frame), above_other = with_itself(other);
	const std::set<std::string> others(above_other.begin(), above_other.end());
	const auto common =
	    std::find_if(above.begin(), above.end(), [&](const std::string& at) { return others.count(at) > 0; });
	if (common == above.end()) return std::nullopt;
	const Path up = climb(frame, *common), other_up = climb(other, *common);
	return Path{up.pose - other_up.pose, up.moves || other_up.moves};
}

std::set<std::string> LinksOfRobot::links_up(const std::string& frame, const std::string& ancestor) const
{
	std::set<std::string> children = {frame};
	for (const std::string& above : ancestors(frame))
	{
		if (above == ancestor) return children;
		children.insert(above);
	}
	return {};
}

std::optional<Path> LinksOfRobot::placement(const std::string& laser, const Robot& robot) const
{
	if (laser == (robot.frame.empty() ? robot.laser_frame : robot.frame)) return Path{};
	if (!are_on_one_robot(laser, robot.frame)) return std::nullopt;
	return path(laser, robot.frame);
}

std::vector<std::string> LinksOfRobot::named(const std::string& name, const std::string& frame) const
{
	std::vector<std::string> found;
	for (const std::string_view base : bases_)
		if (last_part(base) == name && are_on_one_robot(std::string(base), frame)) found.emplace_back(base);
	return found;
}

const LinksOfRobot& AllLinks::of(const std::string& name_space)
{
	auto& links = links_[name_space];
	if (!links) links = std::make_unique<LinksOfRobot>(topics_, name_space);
	return *links;
}

Robot find_robot(const LaserTopic& laser, const RobotTopics& topics, AllLinks& all, const std::string& known)
{
	Robot robot;
	robot.name_space = find_namespace(laser, topics, all);
	const LinksOfRobot& links = all.of(robot.name_space);
	robot.laser_frame = main_frame(laser, links);
	const std::vector<std::string> chain = links.carriers(robot.laser_frame);
	const std::set<std::string> carriers(chain.begin(), chain.end());
	robot.frame = known.empty() ? find_base(robot, chain, links) : known;
	const OdometryTopic* const odometry = find_odometry(robot, laser, carriers, topics, links);
	if (odometry)
	{
		robot.odometry_topic = odometry->topic;
		const std::string& child = odometry->child;
		const bool is_connected = links.are_on_one_robot(child, robot.laser_frame);
		const bool has_base =
		    is_base(robot.frame) && (carriers.count(robot.frame) > 0 || robot.frame == robot.laser_frame);
		if (known.empty() && is_connected && (is_base(child) || (!has_base && carriers.count(child) > 0)))
			robot.frame = child;
		if (robot.frame.empty() && child == robot.laser_frame) robot.frame = child;
		if (is_connected && child != robot.frame) robot.odometry_child = child;
	}
	const auto ancestors = links.ancestors(robot.frame);
	const auto frame = std::find_if(
	    ancestors.begin(), ancestors.end(),
	    [&](const std::string& above) { return is_odometry_frame(above) || (odometry && above == odometry->frame); });
	if (frame != ancestors.end()) robot.odometry_frame = *frame;
	return robot;
}
}  // namespace d2s1r::ros
