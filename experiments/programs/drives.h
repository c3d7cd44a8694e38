// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "recorded_run.h"

namespace d2s1r::experiments
{
constexpr std::size_t kDriveFrames = 40;  //!< [-] of a drive
constexpr std::size_t kSettled = 10;      //!< [-] first frames of a drive, which are not judged
constexpr std::size_t kJump = 20;         //!< [-] frames before a kidnapping

/// A part of a run, or two of them joined.
using Drive = std::vector<const RunFrame*>;

/// Increment from one frame to the next; no value without odometry.
inline std::optional<mrpt::poses::CPose2D> odometry_between(const RunFrame& from, const RunFrame& to)
{
	if (!from.odometry || !to.odometry) return std::nullopt;
	return *to.odometry - *from.odometry;
}

inline Drive drive_from(const std::vector<RunFrame>& run, std::size_t first, std::size_t frames)
{
	Drive drive;
	for (std::size_t i = first; i < std::min(run.size(), first + frames); i++) drive.push_back(&run[i]);
	return drive;
}

/// `count` drives that start evenly spread over the run.
inline std::vector<Drive> spread_drives(const std::vector<RunFrame>& run, std::size_t count)
{
	std::vector<Drive> drives;
	for (std::size_t i = 0; i < count; i++)
		drives.push_back(drive_from(run, i * (run.size() - kDriveFrames) / count, kDriveFrames));
	return drives;
}

/// The same, but after kJump frames they go on half of the run further, without a word.
inline std::vector<Drive> kidnapped_drives(const std::vector<RunFrame>& run, std::size_t count)
{
	std::vector<Drive> drives;
	const std::size_t last = run.size() - kDriveFrames;
	for (std::size_t i = 0; i < count; i++)
	{
		const std::size_t first = i * last / count;
		Drive& drive = drives.emplace_back(drive_from(run, first, kJump));
		const Drive after = drive_from(run, (first + run.size() / 2) % last, kDriveFrames - kJump);
		drive.insert(drive.end(), after.begin(), after.end());
	}
	return drives;
}
}  // namespace d2s1r::experiments
