// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// What LiveLocalizer says, as Cyclone DDS sends it.
#pragma once

#include <live/live_localizer.h>

#include <string>
#include <vector>

#include "ros.h"

namespace d2s1r::live
{
/// The time of day of this machine.
Time wall_clock();

/// Holds a message and the texts and numbers that it points to.
template <typename Message>
struct Owned
{
	Message message{};
	std::vector<std::string> texts;
	std::vector<geometry_msgs_msg_dds__TransformStamped_> transforms;
	std::vector<geometry_msgs_msg_dds__Pose_> poses;
	std::vector<geometry_msgs_msg_dds__Point_> points;
	std::vector<visualization_msgs_msg_dds__Marker_> markers;
	std::vector<diagnostic_msgs_msg_dds__KeyValue_> values;
	std::vector<diagnostic_msgs_msg_dds__DiagnosticStatus_> statuses;
};

builtin_interfaces_msg_dds__Time_ to_stamp(Time time);
geometry_msgs_msg_dds__Pose_ to_message(const mrpt::poses::CPose2D& pose);

template <typename Sequence, typename Value>
void point_to(Sequence& sequence, std::vector<Value>& values)
{
	sequence._buffer = values.data();
	sequence._length = sequence._maximum = static_cast<std::uint32_t>(values.size());
}

Owned<geometry_msgs_msg_dds__PoseWithCovarianceStamped_> pose_message(
    Time time, const std::string& frame, const mrpt::poses::CPose2D& pose,
    const mrpt::math::CMatrixDouble33& covariance);

/// The pose of one frame in another.
Owned<tf2_msgs_msg_dds__TFMessage_> transform_message(
    Time time, const std::string& parent, const std::string& child, const mrpt::poses::CPose2D& pose);

/// The hypotheses, most probable first; none if the scan tells of none.
Owned<geometry_msgs_msg_dds__PoseArray_> hypotheses_message(const ScanAnswer& answer);

/// An arrow with its probability for each hypothesis, and the scan laid at the best one.
Owned<visualization_msgs_msg_dds__MarkerArray_> markers_message(const ScanAnswer& answer);

/// \param space namespace of the node, by which the robots of a fleet are told apart
Owned<diagnostic_msgs_msg_dds__DiagnosticArray_> diagnostics_message(
    Time time, const LiveStatus& status, const std::string& space);
}  // namespace d2s1r::live
