// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cli/flags.h"

#include <set>
#include <string>
#include <vector>

namespace d2s1r::app
{
/// A file of a run.
struct NamedFile
{
	std::string path;
	const char* option;      //!< that it is read or written for
	bool in_folder = false;  //!< whether it belongs to OUT_DIR
};

/// Returns all files that a run writes, in the order in which the user is told.
/// \param localized whether any frame was localized; if none was, --write-pf-ini writes nothing
std::vector<NamedFile> files_written(const Flags& flags, bool localized = true);

/// Returns the names of all files that a run may write to OUT_DIR, whatever its options.
const std::set<std::string>& names_in_folder();

/// Checks that no file would be written over one that is read, or over another that is written; to be called before
/// anything is written.
/// \throws UserError (kBadOutput)
void check_files_apart(const Flags& flags);
}  // namespace d2s1r::app
