// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <base/output_file.h>
#include <d2s1r/grid.h>
#include <d2s1r/scan.h>

#include <filesystem>
#include <memory>

#include "evaluation/run_report.h"
#include "picture/sheet.h"

namespace d2s1r::app
{
class Packer;

/// Collects what report.html shows: a page for a browser with the map, the frames, and the scan of every frame laid
/// over the map at each of its hypotheses. It is one file that needs no network.
class ReportHtml
{
   public:
	/// Opens the file. \throws UserError (kBadOutput)
	explicit ReportHtml(const std::filesystem::path& path);
	~ReportHtml();
	ReportHtml(const ReportHtml&) = delete;
	ReportHtml& operator=(const ReportHtml&) = delete;

	/// Keeps the scan of the next frame, packed, in a file.
	void add(const Scan& scan);

	/// Writes the page of the frames whose scans were added, in the same order.
	/// \param frames of the report, as they are drawn on the grid
	void finish(const RunReport& report, const DrawnFrames& frames, const Grid& grid);

	void commit() { file_.commit(); }

   private:
	std::filesystem::path folder_;
	TextFile file_;
	std::unique_ptr<Packer> scans_;
};
}  // namespace d2s1r::app
