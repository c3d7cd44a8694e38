// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "evaluation/run_report.h"
#include "output/output_file.h"

#include <d2s1r/grid.h>
#include <d2s1r/scan.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace d2s1r::app
{
/// Collects what report.html shows: a page for a browser with the map, the frames, and the scan of every frame laid
/// over the map at each of its hypotheses. It is one file that needs no network.
class ReportHtml
{
   public:
	/// Opens the file. \throws UserError (kBadOutput)
	explicit ReportHtml(const std::string& path);
	~ReportHtml();
	ReportHtml(const ReportHtml&) = delete;
	ReportHtml& operator=(const ReportHtml&) = delete;

	/// Keeps the scan, packed, and what it said alone.
	void add(const Frame& frame, const Scan& scan);

	/// Writes the page of the frames of `report`, which are those that were added, in the same order.
	void finish(const RunReport& report, const Grid& grid);

	/// Gives the file its name.
	void commit() { file_.commit(); }

   private:
	class Packer;
	TextFile file_;
	std::unique_ptr<Packer> scans_;
	std::vector<double> alone_;  //!< by frame, what the scan said alone: see numbers_of() in report_html.cpp
};
}  // namespace d2s1r::app
