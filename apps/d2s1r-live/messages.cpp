// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "messages.h"

#include <mrpt/core/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

namespace d2s1r::live
{
Time wall_clock()
{
	using namespace std::chrono;
	return duration_cast<nanoseconds>(system_clock::now().time_since_epoch()).count();
}

geometry_msgs_msg_dds__Pose_ to_message(const mrpt::poses::CPose2D& pose)
{
	return {{pose.x(), pose.y(), 0}, {0, 0, std::sin(pose.phi() / 2), std::cos(pose.phi() / 2)}};
}

namespace
{
using Marker = visualization_msgs_msg_dds__Marker_;
enum MarkerType : int
{
	kArrow = 0,
	kPoints = 8,
	kText = 9
};

/// A marker without a shape yet, which takes the texts of `owner`, the first of which is empty and the second the
/// frame.
Marker marker_of(Owned<visualization_msgs_msg_dds__MarkerArray_>& owner, const ScanAnswer& answer, int type)
{
	Marker marker{};
	marker.header = {to_stamp(answer.time), owner.texts[1].data()};
	marker.ns = marker.texture_resource = marker.text = marker.mesh_resource = owner.texts[0].data();
	marker.texture.header.frame_id = marker.texture.format = marker.mesh_file.filename = owner.texts[0].data();
	marker.id = static_cast<int>(owner.markers.size());
	marker.type = type;
	marker.pose.orientation.w = 1;
	return marker;
}

void add_hypothesis(Owned<visualization_msgs_msg_dds__MarkerArray_>& owner, const ScanAnswer& answer, std::size_t rank)
{
	const Hypothesis& hypothesis = answer.localization.hypotheses[rank];
	const auto shade = static_cast<float>(std::clamp(hypothesis.probability, 0.15, 1.0));
	Marker arrow = marker_of(owner, answer, kArrow);
	arrow.pose = to_message(hypothesis.pose);
	arrow.scale = {0.8, 0.12, 0.12};
	arrow.color = rank == 0 ? std_msgs_msg_dds__ColorRGBA_{0, 0.7F, 0.2F, shade}
	                        : std_msgs_msg_dds__ColorRGBA_{0.9F, 0.5F, 0, shade};
	owner.markers.push_back(arrow);
	Marker label = marker_of(owner, answer, kText);
	label.pose = arrow.pose;
	label.pose.position.z = 0.4;
	label.scale = {0, 0, 0.35};
	label.color = {0.1F, 0.1F, 0.1F, 1};
	owner.texts.push_back(mrpt::format("%.3f", hypothesis.probability));
	label.text = owner.texts.back().data();
	owner.markers.push_back(label);
}

void add_scan(Owned<visualization_msgs_msg_dds__MarkerArray_>& owner, const ScanAnswer& answer)
{
	const auto sensor = answer.localization.best().pose + mrpt::poses::CPose2D(answer.scan.sensor_on_robot);
	for (const Beam& beam : answer.scan.beams)
	{
		if (!beam.is_return) continue;
		const double angle = sensor.phi() + static_cast<double>(beam.angle), range = static_cast<double>(beam.range);
		owner.points.push_back({sensor.x() + range * std::cos(angle), sensor.y() + range * std::sin(angle), 0.05});
	}
	Marker points = marker_of(owner, answer, kPoints);
	points.scale = {0.05, 0.05, 0};
	points.color = {0.9F, 0.1F, 0.1F, 0.9F};
	point_to(points.points, owner.points);
	owner.markers.push_back(points);
}
}  // namespace

builtin_interfaces_msg_dds__Time_ to_stamp(Time time)
{
	return {static_cast<std::int32_t>(time / kSecond), static_cast<std::uint32_t>(time % kSecond)};
}

Owned<geometry_msgs_msg_dds__PoseWithCovarianceStamped_> pose_message(
    Time time, const std::string& frame, const mrpt::poses::CPose2D& pose,
    const mrpt::math::CMatrixDouble33& covariance)
{
	Owned<geometry_msgs_msg_dds__PoseWithCovarianceStamped_> owned;
	owned.texts = {frame};
	owned.message.header = {to_stamp(time), owned.texts[0].data()};
	owned.message.pose.pose = to_message(pose);
	constexpr int kPlaces[] = {0, 1, 5};  // of x, y and yaw among the six of ROS
	for (int row = 0; row < 3; row++)
		for (int column = 0; column < 3; column++)
			owned.message.pose.covariance[6 * kPlaces[row] + kPlaces[column]] = covariance(row, column);
	return owned;
}

Owned<tf2_msgs_msg_dds__TFMessage_> transform_message(
    Time time, const std::string& parent, const std::string& child, const mrpt::poses::CPose2D& pose)
{
	Owned<tf2_msgs_msg_dds__TFMessage_> owned;
	owned.texts = {parent, child};
	const auto [position, orientation] = to_message(pose);
	owned.transforms.push_back(
	    {{to_stamp(time), owned.texts[0].data()},
	     owned.texts[1].data(),
	     {{position.x, position.y, position.z}, orientation}});
	point_to(owned.message.transforms, owned.transforms);
	return owned;
}

Owned<geometry_msgs_msg_dds__PoseArray_> hypotheses_message(const ScanAnswer& answer)
{
	Owned<geometry_msgs_msg_dds__PoseArray_> owned;
	owned.texts = {answer.frame};
	owned.message.header = {to_stamp(answer.time), owned.texts[0].data()};
	for (const Hypothesis& hypothesis : answer.localization.hypotheses)
		owned.poses.push_back(to_message(hypothesis.pose));
	point_to(owned.message.poses, owned.poses);
	return owned;
}

Owned<visualization_msgs_msg_dds__MarkerArray_> markers_message(const ScanAnswer& answer)
{
	constexpr int kDeleteAll = 3;
	Owned<visualization_msgs_msg_dds__MarkerArray_> owned;
	const auto& hypotheses = answer.localization.hypotheses;
	owned.texts.reserve(2 + hypotheses.size());  // markers point to them
	owned.texts = {"", answer.frame};
	Marker clear = marker_of(owned, answer, kArrow);
	clear.action = kDeleteAll;
	owned.markers.push_back(clear);
	for (std::size_t rank = 0; rank < hypotheses.size(); rank++) add_hypothesis(owned, answer, rank);
	if (!hypotheses.empty()) add_scan(owned, answer);
	point_to(owned.message.markers, owned.markers);
	return owned;
}

Owned<diagnostic_msgs_msg_dds__DiagnosticArray_> diagnostics_message(
    Time time, const LiveStatus& status, const std::string& space)
{
	Owned<diagnostic_msgs_msg_dds__DiagnosticArray_> owned;
	owned.texts.reserve(3 + 2 * status.values.size());
	owned.texts = {"", (space == "/" ? "" : space.substr(1) + "/") + "d2s1r: localization", status.summary};
	for (const auto& [name, value] : status.values)
	{
		owned.texts.push_back(name);
		owned.texts.push_back(value);
		owned.values.push_back({owned.texts[owned.texts.size() - 2].data(), owned.texts.back().data()});
	}
	diagnostic_msgs_msg_dds__DiagnosticStatus_ one{};
	one.level = static_cast<std::uint8_t>(status.level);
	one.name = owned.texts[1].data();
	one.message = owned.texts[2].data();
	one.hardware_id = owned.texts[0].data();
	point_to(one.values, owned.values);
	owned.statuses.push_back(one);
	owned.message.header = {to_stamp(time), owned.texts[0].data()};
	point_to(owned.message.status, owned.statuses);
	return owned;
}
}  // namespace d2s1r::live
