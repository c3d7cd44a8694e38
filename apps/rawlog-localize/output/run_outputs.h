// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <d2s1r/grid.h>
#include <shell/indexed_maps.h>

#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "cli/command_line.h"
#include "evaluation/run_report.h"
#include "mrpt/mrpt_files.h"
#include "output/frame_outputs.h"
#include "output/report_html.h"
#include "picture/sheet.h"

namespace d2s1r::app
{
struct NamedFile
{
	std::string path;
	const char* option;      //!< that it is read or written for
	bool in_folder = false;  //!< whether it belongs to OUT_DIR
};

/// Returns the files of --write-pf-ini: the ini file, and beside it the rawlog and the map.
std::array<std::string, 3> pf_files(const std::string& ini);

/// Returns all files that a run writes, in the order in which the user is told.
/// \param localized whether any frame was localized; if none was, --write-pf-ini writes nothing
std::vector<NamedFile> files_written(const CommandLine& command, bool localized = true);

/// Returns the names of the files in OUT_DIR that a run would write if this build had what they need.
std::vector<std::string> files_left_out(const CommandLine& command);

/// Returns the names of all files that a run may write to OUT_DIR, whatever its options.
const std::set<std::string>& names_in_folder();

/// Checks that no file would be written over one that is read, or over another that is written; to be called before
/// anything is written.
/// \throws UserError (kBadOutput)
void check_files_apart(const CommandLine& command, const std::vector<MapSource>& maps);

/// A folder that is made if it is missing, with all that it lies in. What was made is removed again if it is empty when
/// the object goes out of scope.
class OutputFolder
{
   public:
	/// \throws UserError (kBadOutput)
	explicit OutputFolder(const std::string& path);
	~OutputFolder() { remove_made(); }
	OutputFolder(const OutputFolder&) = delete;
	OutputFolder& operator=(const OutputFolder&) = delete;

   private:
	void remove_made();

	std::vector<std::filesystem::path> made_;  //!< the innermost first
};

/// The files of --index. Those that are not there yet are tried before anything is computed, and what killed processes
/// left of any of them is removed.
class IndexFiles
{
   public:
	/// Makes the folder of an atlas. \param folder_or_file of --index; empty: none. \throws UserError (kBadOutput)
	IndexFiles(const std::string& folder_or_file, const std::vector<MapSource>& maps);

   private:
	std::optional<OutputFolder> folder_;  //!< of an atlas
};

/// All files of a run. They are opened before anything is computed, so that one that cannot be written is found at
/// once, and appear together at the end, summary.json last: where it stands, the folder is whole.
class RunOutputs
{
   public:
	/// Makes the folder and opens all files. Keeps a reference to `command`. \throws UserError (kBadOutput)
	explicit RunOutputs(const CommandLine& command);

	const FrameStore& frames() const { return frames_.frames(); }
	void add(const logs::RawlogObject& object);
	void add(const Frame& frame, const ScanPtr& scan);
	ReportHtml& page() { return page_; }

	void save_map(const OccupancyMap& map, const Parameters& parameters);

	/// Writes all files that tell of the whole run, removes those of an earlier run from the folder and gives the new
	/// ones their names.
	void commit(const RunReport& report);

   private:
	void finish(const RunReport& report);
	void draw(const RunReport& report, const DrawnFrames& frames, const Grid& grid, const std::vector<MapName>& names);
	void remove_files_of_earlier_run() const;

	const CommandLine& command_;
	OutputFolder folder_;
	FrameOutputs frames_;
	std::unique_ptr<MrptFiles> mrpt_files_;  //!< null if the build lacks them
	std::optional<TextFile> config_;
	std::optional<PendingFile> map_png_;  //!< if the build draws it
	ReportHtml page_;
	TextFile run_json_;
	TextFile summary_;
};
}  // namespace d2s1r::app
