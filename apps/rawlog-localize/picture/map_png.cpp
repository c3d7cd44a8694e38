// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "picture/map_png.h"

#include "cli/console.h"
#include "evaluation/run_report.h"
#include "output/output_file.h"
#include "picture/canvas.h"
#include "picture/map_view.h"

#include <mrpt/core/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace d2s1r::app
{
namespace
{
constexpr int kMargin = 20;          //!< [pixel]
constexpr int kRowHeight = 32;       //!< [pixel]
constexpr int kSampleWidth = 34;     //!< [pixel]
constexpr int kGap = 28;             //!< [pixel] between entries
constexpr double kLongestBar = 0.2;  //!< [-] of the width

/// The longest of 1, 2, 5, 10, ... (or a tenth, ...) that is not above `limit`.
double round_length(double limit)
{
	const double power = std::pow(10.0, std::floor(std::log10(limit)));
	for (const double step : {5.0, 2.0})
		if (step * power <= limit) return step * power;
	return power;
}

const mrpt::img::TColor kInk(40, 44, 52);

/// A sample of a mark, drawn around a centre, and what it stands for.
struct LegendEntry
{
	std::function<void(Canvas&, const Pixel& center)> draw_sample;
	std::string text;
};

/// The strip below a map: a scale bar and the entries, in as many rows as the width asks for.
class Legend
{
   public:
	Legend(std::vector<LegendEntry> entries, double pixels_per_metre, int width);
	int height() const;
	void draw(Canvas& canvas, int top) const;

   private:
	struct Place
	{
		int left;
		int row;
	};
	void draw_scale_bar(Canvas& canvas, int top) const;

	std::vector<LegendEntry> entries_;
	std::vector<Place> places_;
	double bar_metres_;  //!< [m]
	int bar_pixels_;     //!< [pixel]
	int rows_ = 1;
};

Legend::Legend(std::vector<LegendEntry> entries, double pixels_per_metre, int width)
    : entries_(std::move(entries)),
      bar_metres_(round_length(kLongestBar * width / pixels_per_metre)),
      bar_pixels_(static_cast<int>(std::lround(bar_metres_ * pixels_per_metre)))
{
	const int bar_room = std::max(bar_pixels_, 8 * Canvas::kLetterWidth) + kGap;
	int left = kMargin + bar_room;
	for (const auto& entry : entries_)
	{
		const int needed = kSampleWidth + Canvas::kLetterWidth * static_cast<int>(entry.text.size());
		if (left + needed > width - kMargin && left > kMargin + bar_room)
		{
			left = kMargin + bar_room;
			rows_++;
		}
		places_.push_back({left, rows_ - 1});
		left += needed + kGap;
	}
	rows_ = std::max(rows_, 2);
}

int Legend::height() const
{
	return rows_ * kRowHeight + kMargin;
}

void Legend::draw(Canvas& canvas, int top) const
{
	for (int y = top; y < top + height(); y++)
		for (int x = 0; x < canvas.width(); x++) canvas.point(x, y, y == top ? kInk : mrpt::img::TColor::white());
	draw_scale_bar(canvas, top);
	for (std::size_t i = 0; i < entries_.size(); i++)
	{
		const int middle = top + kMargin / 2 + places_[i].row * kRowHeight + kRowHeight / 2;
		entries_[i].draw_sample(canvas, Pixel(places_[i].left + kSampleWidth / 2 - 4, middle));
		canvas.text(places_[i].left + kSampleWidth, middle - Canvas::kLetterHeight / 2, entries_[i].text, kInk);
	}
}

void Legend::draw_scale_bar(Canvas& canvas, int top) const
{
	const double left = kMargin, right = kMargin + bar_pixels_, y = top + kMargin / 2 + 18;
	canvas.line({left, y}, {right, y}, 3, kInk);
	canvas.line({left, y - 6}, {left, y + 6}, 3, kInk);
	canvas.line({right, y - 6}, {right, y + 6}, 3, kInk);
	canvas.text(kMargin, static_cast<int>(y) + 10, mrpt::format("%g m", bar_metres_), kInk);
}

using DrawLine = void (*)(Canvas&, const Pixel&, const Pixel&);

LegendEntry line_entry(DrawLine draw, const std::string& text)
{
	return {[draw](Canvas& canvas, const Pixel& at) { draw(canvas, {at.x - 13, at.y}, {at.x + 13, at.y}); }, text};
}

void draw_localized(Canvas& canvas, const Pixel& at)
{
	draw_path(canvas, {at.x - 13, at.y}, {at.x + 13, at.y});
	draw_place(canvas, at);
	draw_heading(canvas, at, 0.9);
}

void draw_ambiguous(Canvas& canvas, const Pixel& at)
{
	draw_hypothesis(canvas, at, 1);
}

void draw_nothing(Canvas&, const Pixel&) {}

std::string counted(const std::string& what, std::ptrdiff_t count)
{
	return what + " (" + std::to_string(count) + ")";
}

/// Counts the frames that have neither a pose nor ground truth.
std::ptrdiff_t count_without_place(const MapPicture& picture)
{
	std::set<const Frame*> with_truth;
	for (const auto& m : picture.matches) with_truth.insert(m.frame);
	return std::count_if(
	    picture.frames.begin(), picture.frames.end(),
	    [&](const Frame& frame) { return !frame.has_pose() && with_truth.count(&frame) == 0; });
}

void add_failures(const MapPicture& picture, std::vector<LegendEntry>& entries)
{
	std::ptrdiff_t failures = 0, errors = 0;
	for (const auto& m : picture.matches)
	{
		if (m.within(kTolerances.front())) continue;
		failures++;
		errors += m.frame->has_pose();
	}
	if (!picture.truth.empty())
		entries.push_back({draw_failure, counted("wrong or no pose, at its true place", failures)});
	if (errors > 0) entries.push_back(line_entry(draw_error, counted("from there to the wrong pose", errors)));
	const auto without_place = count_without_place(picture);
	if (without_place > 0)
		entries.push_back({draw_nothing, std::to_string(without_place) + " rejected or invalid (not drawn)"});
}

void add_fusion(const std::vector<Frame>& frames, std::vector<LegendEntry>& entries)
{
	const auto is_fused = [](const Frame& frame) { return frame.fused.has_value(); };
	const auto is_reseeded = [](const Frame& frame)
	{ return frame.fused && frame.fused->event == FusionEvent::kReseeded; };
	if (std::any_of(frames.begin(), frames.end(), is_fused)) entries.push_back(line_entry(draw_fused, "fused"));
	const auto reseeds = std::count_if(frames.begin(), frames.end(), is_reseeded);
	if (reseeds > 0) entries.push_back({draw_reseed, counted("re-seeded", reseeds)});
}

std::vector<LegendEntry> map_legend(const MapPicture& picture)
{
	const auto counts = count_statuses(picture.frames);
	std::vector<LegendEntry> entries = {
	    {draw_localized, "localized, heading (" + std::to_string(counts[0]) + ")"},
	    {draw_ambiguous, "ambiguous (" + std::to_string(counts[1]) + "), other hypotheses"}};
	add_failures(picture, entries);
	add_fusion(picture.frames, entries);
	if (!picture.truth.empty()) entries.push_back(line_entry(draw_truth, "ground truth"));
	return entries;
}

constexpr int kLongSide = 1600;      //!< [pixel] of the map
constexpr double kLargestCell = 24;  //!< [pixel] of small maps
constexpr int kLeastWidth = 900;     //!< [pixel] of the picture: room for the legend
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

	/// Marks wrong frames where the ground truth says that they were taken.
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
