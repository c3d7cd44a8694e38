// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <base/own_process.h>

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "formats.h"
#include "logs/log.h"
#include "unpacking_stream.h"

namespace d2s1r::logs
{
/// Reads a rawlog of either kind.
class RawlogReader : public LogReader
{
   public:
	/// \param stream holds the rawlog, unpacked
	/// \param left_out as open_log() has it
	explicit RawlogReader(std::unique_ptr<InputStream> stream, Labels left_out = {})
	    : stream_(std::move(stream)), left_out_(std::move(left_out))
	{
	}

	std::optional<RawlogObject> next() override;

	/// Returns what next() does, those included that are left out.
	std::optional<RawlogObject> read();

   private:
	std::string place() const;
	std::string end_within_object() const;
	std::string unreadable(const std::exception& error);

	std::unique_ptr<InputStream> stream_;
	Labels left_out_;
	std::size_t objects_ = 0;              //!< [-] read so far
	std::optional<std::string> odometer_;  //!< label
};

/// Returns what is wrong with a rawlog whose reading in a process of its own ended in a bad way, after `objects`
/// objects.
std::string damage_that_ended(ProcessEnd end, std::size_t objects);
}  // namespace d2s1r::logs
