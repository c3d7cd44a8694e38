// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "map_png.h"

#include "console.h"
#include "map_crop.h"
#include "map_legend.h"
#include "map_marks.h"
#include "map_view.h"
#include "output_file.h"
#include "path_pieces.h"
#include "run_report.h"
#include "whole_file.h"

#include <algorithm>
#include <optional>

namespace d2s1r::app
{
namespace
{
constexpr int kLongSide = 1600;      //!< [pixel] of the map
constexpr double kLargestCell = 24;  //!< [pixel] of small maps
constexpr int kLeastWidth = 900;     //!< [pixel] of the picture: room for the legend
constexpr int kMargin = 20;          //!< [pixel]
constexpr double kTickSpacing = 15;  //!< [pixel] between headings that are drawn
const mrpt::img::TColor kPaper(222, 222, 222);

class Painter
{
   public:
	Painter(const MapPicture& picture, const MapView& view, Canvas& canvas)
	    : picture_(picture), view_(view), canvas_(canvas)
	{
	}

	void paint_truth()
	{
		const TimedPose* last = nullptr;
		for (const auto& line : picture_.truth)
		{
			const bool jump = !last || is_jump(last->pose, line.pose, line.timestamp - last->timestamp);
			draw_truth(canvas_, at(jump ? line.pose : last->pose), at(line.pose));
			last = &line;
		}
	}

	void paint_hypotheses()
	{
		for (const auto& frame : picture_.frames)
			for (std::size_t i = frame.localized() ? 1 : 0; i < frame.result.hypotheses.size(); i++)
			{
				const Hypothesis& h = frame.result.hypotheses[i];
				if (h.probability >= 0.05) draw_hypothesis(canvas_, at(h.pose.asTPose()), h.probability);
			}
	}

	void paint_path()
	{
		const auto pieces = path_pieces(picture_.frames);
		for (const auto& piece : pieces)
			for (std::size_t i = 1; i < piece.size(); i++) draw_path(canvas_, at(*piece[i - 1]), at(*piece[i]));
		for (const auto& piece : pieces)
		{
			std::optional<Pixel> last;
			for (const Frame* frame : piece)
			{
				const Pixel from = at(*frame);
				draw_place(canvas_, from);
				if (last && (from - *last).norm() < kTickSpacing) continue;
				draw_heading(canvas_, from, frame->result.best().pose.phi());
				last = from;
			}
		}
	}

	/// Frames that are off, where the ground truth says that they were taken; of others that is not known.
	void paint_failures()
	{
		for (const auto& m : picture_.matches)
		{
			if (m.within(kTolerances.front())) continue;
			if (m.frame->has_pose()) draw_error(canvas_, at(m.truth->pose), at(*m.frame));
			draw_failure(canvas_, at(m.truth->pose));
		}
	}

	void paint_fused()
	{
		const Frame* last = nullptr;
		for (const auto& frame : picture_.frames)
		{
			if (frame.fused && last && frame.fused->event == FusionEvent::kNone)
				draw_fused(canvas_, at(last->fused->pose), at(frame.fused->pose));
			if (frame.fused && frame.fused->event == FusionEvent::kReseeded)
				draw_reseed(canvas_, at(frame.fused->pose));
			last = frame.fused ? &frame : nullptr;
		}
	}

   private:
	Pixel at(const mrpt::math::TPose2D& pose) const { return view_.pixel(pose.x, pose.y); }
	Pixel at(const Frame& frame) const { return at(frame.result.best().pose.asTPose()); }

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
}  // namespace

void write_map_png(const MapPicture& picture, const std::string& path)
{
	const Grid grid = crop_for_picture(make_grid(picture.map, picture.thresholds), places(picture));
	MapView view = fit_view(grid, kLongSide, kLargestCell);
	const int width = std::max(view.width + 2 * kMargin, kLeastWidth);
	const Legend legend(map_legend(picture), view.scale, width);
	view.offset_x = (width - view.width) / 2;
	view.offset_y = kMargin;

	Canvas canvas(width, view.height + 2 * kMargin + legend.height(), kPaper);
	draw_map(grid, view, canvas);
	Painter painter(picture, view, canvas);
	painter.paint_truth();
	painter.paint_hypotheses();
	painter.paint_path();
	painter.paint_fused();
	painter.paint_failures();
	legend.draw(canvas, view.height + 2 * kMargin);

	PendingFile pending(path);
	const SilentDescriptors silence;  // libpng tells standard error when the disk is full
	if (!canvas.image().saveToFile(pending.temporary()) || !is_whole_png(pending.temporary())) pending.fail();
	pending.commit();
}
}  // namespace d2s1r::app
