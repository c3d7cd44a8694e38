// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cli/flags.h"

#include <string>
#include <vector>

namespace d2s1r::app
{
/// A file of a run.
struct NamedFile
{
	std::string path;
	const char* option;  //!< that it is read or written for
};

/// All files that a run writes, in the order they are told to the user.
/// \param localized whether any frame was: if none was, --write-pf-ini writes nothing
std::vector<NamedFile> files_written(const Flags& flags, bool localized = true);

/// Call before anything is written. \throws UserError (kBadOutput) if a file would be written over one that is read,
/// or over another that is written
void check_files_apart(const Flags& flags);
}  // namespace d2s1r::app
