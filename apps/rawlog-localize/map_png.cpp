// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "map_png.h"

#include "console.h"
#include "legend.h"
#include "map_crop.h"
#include "map_view.h"
#include "output_file.h"
#include "path_pieces.h"
#include "run_report.h"
#include "whole_file.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace d2s1r::app
{
namespace
{
using mrpt::img::TColor;
constexpr int kLongSide = 1600;      //!< [pixel] of the map
constexpr double kLargestCell = 24;  //!< [pixel] of small maps
constexpr int kLeastWidth = 900;     //!< [pixel] of the picture: room for the legend
constexpr int kMargin = 20;          //!< [pixel]
constexpr double kTickLength = 13;   //!< [pixel]
constexpr double kTickSpacing = 15;  //!< [pixel] between headings that are drawn
const TColor kPaper(222, 222, 222), kPath(20, 99, 196), kTruth(118, 200, 120), kGuess(245, 150, 20),
    kWrong(214, 34, 50), kFused(133, 40, 160);

class Painter
{
   public:
	Painter(const MapPicture& picture, const MapView& view, Canvas& canvas)
	    : picture_(picture), view_(view), canvas_(canvas)
	{
	}

	void draw_truth()
	{
		const TimedPose* last = nullptr;
		for (const auto& line : picture_.truth)
		{
			const bool jump = !last || is_jump(last->pose, line.pose, line.timestamp - last->timestamp);
			canvas_.line(at(jump ? line.pose : last->pose), at(line.pose), 7, kTruth);
			last = &line;
		}
	}

	void draw_hypotheses()
	{
		for (const auto& frame : picture_.frames)
			for (std::size_t i = frame.localized() ? 1 : 0; i < frame.result.hypotheses.size(); i++)
			{
				const Hypothesis& h = frame.result.hypotheses[i];
				if (h.probability < 0.05) continue;
				canvas_.disc(at(h.pose.asTPose()), 2 + 3 * std::sqrt(h.probability), kGuess, 0.75);
			}
	}

	void draw_path()
	{
		const auto pieces = path_pieces(picture_.frames);
		for (const auto& piece : pieces)
			for (std::size_t i = 1; i < piece.size(); i++) canvas_.line(at(*piece[i - 1]), at(*piece[i]), 2.4, kPath);
		for (const auto& piece : pieces)
		{
			std::optional<Pixel> last;
			for (const Frame* frame : piece)
			{
				const Pixel from = at(*frame);
				canvas_.disc(from, 2.2, kPath);
				if (last && (from - *last).norm() < kTickSpacing) continue;
				draw_heading(*frame);
				last = from;
			}
		}
	}

	/// With ground truth: frames that are off, a cross at the true place and a line to the wrong one. Frames without a
	/// pose and without ground truth: a cross where the robot was last seen.
	void draw_failures()
	{
		for (const auto& m : picture_.matches)
		{
			if (m.within(kTolerances.front())) continue;
			if (m.frame->has_pose()) canvas_.line(at(m.truth->pose), at(*m.frame), 1.2, kWrong, 0.3);
			canvas_.cross(at(m.truth->pose), 5, 2.4, kWrong);
		}
		if (!picture_.matches.empty()) return;
		const Frame* last = nullptr;
		for (const auto& frame : picture_.frames)
			if (frame.has_pose())
				last = &frame;
			else if (last)
				canvas_.cross(at(*last), 5, 2.4, kWrong);
	}

	void draw_fused()
	{
		const Frame* last = nullptr;
		for (const auto& frame : picture_.frames)
		{
			if (frame.fused && last && frame.fused->event == FusionEvent::kNone)
				canvas_.line(at(last->fused->pose), at(frame.fused->pose), 1.5, kFused);
			if (frame.fused && frame.fused->event == FusionEvent::kReseeded)
				canvas_.cross(at(frame.fused->pose), 5, 1.5, kFused);
			last = frame.fused ? &frame : nullptr;
		}
	}

	static void draw_arrow(Canvas& canvas, const Pixel& from, double phi, const TColor& color)
	{
		const Pixel tip(from.x + kTickLength * std::cos(phi), from.y - kTickLength * std::sin(phi));
		canvas.line(from, tip, 1.6, color);
		for (const double side : {-2.6, 2.6})
			canvas.line(tip, {tip.x + 5 * std::cos(phi + side), tip.y - 5 * std::sin(phi + side)}, 1.6, color);
	}

   private:
	Pixel at(const mrpt::math::TPose2D& pose) const { return view_.pixel(pose.x, pose.y); }
	Pixel at(const Frame& frame) const { return at(frame.result.best().pose.asTPose()); }
	void draw_heading(const Frame& frame) { draw_arrow(canvas_, at(frame), frame.result.best().pose.phi(), kPath); }

	const MapPicture& picture_;
	const MapView& view_;
	Canvas& canvas_;
};

std::vector<mrpt::math::TPoint2D> places(const MapPicture& picture)
{
	std::vector<mrpt::math::TPoint2D> points;
	for (const auto& frame : picture.frames)
		if (frame.has_pose()) points.emplace_back(frame.result.best().pose.x(), frame.result.best().pose.y());
	for (const auto& line : picture.truth) points.emplace_back(line.pose.x, line.pose.y);
	return points;
}

std::vector<LegendEntry> legend_entries(const MapPicture& picture)
{
	const auto counts = count_statuses(picture.frames);
	const bool truth = !picture.truth.empty();
	const auto failures = std::count_if(
	    picture.matches.begin(), picture.matches.end(), [](const Match& m) { return !m.within(kTolerances.front()); });
	std::vector<LegendEntry> entries;
	entries.push_back(
	    {[](Canvas& canvas, const Pixel& at)
	     {
		     canvas.line({at.x - 13, at.y}, {at.x + 13, at.y}, 2.4, kPath);
		     canvas.disc(at, 2.2, kPath);
		     Painter::draw_arrow(canvas, at, 0.9, kPath);
	     },
	     "localized, heading (" + std::to_string(counts[0]) + ")"});
	entries.push_back(
	    {[](Canvas& canvas, const Pixel& at) { canvas.disc(at, 5, kGuess); },
	     "ambiguous (" + std::to_string(counts[1]) + "), other hypotheses"});
	entries.push_back(
	    {[](Canvas& canvas, const Pixel& at) { canvas.cross(at, 5, 2.4, kWrong); },
	     truth ? "wrong or no pose, at its true place (" + std::to_string(failures) + ")"
	           : "rejected or invalid (" + std::to_string(counts[2] + counts[3]) + ")"});
	if (std::any_of(picture.frames.begin(), picture.frames.end(), [](const Frame& f) { return f.fused.has_value(); }))
		entries.push_back(
		    {[](Canvas& canvas, const Pixel& at) {
			     canvas.line({at.x - 13, at.y}, {at.x + 13, at.y}, 1.5, kFused);
		     },
		     "fused"});
	if (truth)
		entries.push_back(
		    {[](Canvas& canvas, const Pixel& at) {
			     canvas.line({at.x - 13, at.y}, {at.x + 13, at.y}, 7, kTruth);
		     },
		     "ground truth"});
	return entries;
}
}  // namespace

void write_map_png(const MapPicture& picture, const std::string& path)
{
	const Grid grid = crop_for_picture(make_grid(picture.map, picture.thresholds), places(picture));
	MapView view = fit_view(grid, kLongSide, kLargestCell);
	const int width = std::max(view.width + 2 * kMargin, kLeastWidth);
	const Legend legend(legend_entries(picture), view.scale, width);
	view.offset_x = (width - view.width) / 2;
	view.offset_y = kMargin;

	Canvas canvas(width, view.height + 2 * kMargin + legend.height(), kPaper);
	draw_map(grid, view, canvas);
	Painter painter(picture, view, canvas);
	painter.draw_truth();
	painter.draw_hypotheses();
	painter.draw_path();
	painter.draw_fused();
	painter.draw_failures();
	legend.draw(canvas, view.height + 2 * kMargin);

	PendingFile pending(path);
	const SilentDescriptors silence;  // libpng tells standard error when the disk is full
	if (!canvas.image().saveToFile(pending.temporary()) || !is_whole_png(pending.temporary())) pending.fail();
	pending.commit();
}
}  // namespace d2s1r::app
