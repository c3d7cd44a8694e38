// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "logs/log.h"
#include "logs/own_process.h"

#include <mrpt/io/CFileGZInputStream.h>

#include <optional>
#include <string>

namespace d2s1r::logs
{
/// Reads a rawlog of either kind.
class RawlogReader : public LogReader
{
   public:
	/// \throws LogError
	explicit RawlogReader(const std::string& file);

	std::optional<RawlogObject> next() override;

   private:
	std::string end_within_object() const;
	std::string unreadable(const std::exception& error) const;

	mrpt::io::CFileGZInputStream stream_;
	std::size_t objects_ = 0;              //!< [-] read so far
	std::optional<std::string> odometer_;  //!< label
};

/// Reads a rawlog to its end, or to where it is damaged, in a process of its own.
/// \throws LogError if it cannot be opened, Interrupted if `stop` said so
LogSurvey survey_rawlog(const std::string& file, const Stop& stop);
}  // namespace d2s1r::logs
