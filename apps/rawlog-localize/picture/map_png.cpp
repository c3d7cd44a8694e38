// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "picture/map_png.h"

#include <base/output_file.h>
#include <mrpt/core/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "picture/canvas.h"
#include "picture/map_view.h"

namespace d2s1r::app
{
const bool kDrawsMapPng = true;

namespace
{
constexpr const char *kXTitle = "x [m]", *kYTitle = "y [m]";
constexpr double kTickLength = 8;  //!< [pixel]
constexpr double kNumberGap = 6;   //!< [pixel] between ticks and numbers
constexpr Color kAxisColor{96, 100, 110};

/// Returns the longest of 1, 2, 5, 10, ... (or a tenth of these, ...) that is not above `limit`.
double round_length(double limit)
{
	const double power = std::pow(10.0, std::floor(std::log10(limit)));
	for (const double step : {5.0, 2.0})
		if (step * power <= limit) return step * power;
	return power;
}

/// Returns the distance of the ticks [m]: two of them on the short side at least, but at most 14 on the long side.
double tick_step(double width, double height)
{
	const double longer = std::max(width, height), shorter = std::min(width, height);
	return round_length(std::max(longer / 14, std::min(longer / 6, shorter / 2)));
}

/// The coordinates of the map frame [m] along the left and the lower edge of a map.
class Axes
{
   public:
	/// \param view of the map; its offset does not matter yet
	explicit Axes(const MapView& view)
	{
		const double width = view.width / view.scale, height = view.height / view.scale;
		const double step = tick_step(width, height);
		x_ = ticks(view.left, view.left + width, step);
		y_ = ticks(view.top - height, view.top, step);
		double widest = Canvas(1, 1, kAxisColor).text_width(kXTitle) + kNumberGap;
		for (const Tick& tick : y_) widest = std::max(widest, tick.width);
		left_width_ = static_cast<int>(std::ceil(widest + kTickLength + 3 * kNumberGap));
	}

	int left_width() const { return left_width_; }  //!< [pixel] left of the map
	static constexpr int kTopHeight = 38;           //!< [pixel] above the map
	static constexpr int kBottomHeight = 48;        //!< [pixel] below the map

	/// \param view where the map lies now
	void draw(Canvas& canvas, const MapView& view) const
	{
		const double left = view.offset_x, top = view.offset_y, bottom = top + view.height;
		const double numbers = bottom + kTickLength + kNumberGap + Canvas::kTextHeight / 2;
		canvas.line({{left, top}, {left, bottom}, {left + view.width, bottom}}, 1.5, kAxisColor);
		for (const Tick& tick : x_)
		{
			const double x = view.pixel(tick.at, view.top).x;
			canvas.line({{x, bottom}, {x, bottom + kTickLength}}, 1.5, kAxisColor);
			canvas.text(x - tick.width / 2, numbers, tick.label, kAxisColor);
		}
		for (const Tick& tick : y_)
		{
			const double y = view.pixel(view.left, tick.at).y;
			canvas.line({{left - kTickLength, y}, {left, y}}, 1.5, kAxisColor);
			if (y > bottom - Canvas::kTextHeight / 4) continue;  // the title of the other axis is there
			canvas.text(left - kTickLength - kNumberGap - tick.width, y, tick.label, kAxisColor);
		}
		canvas.text(left - left_width_ + kNumberGap, numbers, kXTitle, kAxisColor);
		canvas.text(left - left_width_ + kNumberGap, top - kTopHeight / 2.0, kYTitle, kAxisColor);
	}

   private:
	struct Tick
	{
		double at;          //!< [m]
		std::string label;  //!< the same as text
		double width;       //!< [pixel] of the text
	};

	static std::vector<Tick> ticks(double first, double last, double step)
	{
		Canvas ruler(1, 1, kAxisColor);
		std::vector<Tick> found;
		for (double i = std::ceil(first / step); i * step <= last; i++)
		{
			const std::string label = mrpt::format("%g", i == 0 ? 0.0 : i * step);  // not "-0"
			found.push_back({i * step, label, ruler.text_width(label)});
		}
		return found;
	}

	std::vector<Tick> x_, y_;
	int left_width_ = 0;
};

constexpr int kLongSide = 1600;      //!< [pixel] of the map
constexpr double kLargestCell = 24;  //!< [pixel] of small maps
constexpr int kLeastWidth = 1000;    //!< [pixel] of the picture, which has room for the legend
constexpr int kMargin = 20;          //!< [pixel]
constexpr int kRowHeight = 36;       //!< [pixel] of the legend
constexpr double kSampleWidth = 46;  //!< [pixel] of a mark in the legend
constexpr double kGap = 34;          //!< [pixel] between entries of the legend
constexpr double kLongestBar = 0.2;  //!< [-] of the width
constexpr double kTickSpacing = 15;  //!< [pixel] between headings that are drawn
constexpr Color kPaper{222, 222, 222}, kWhite{255, 255, 255}, kStartColor{0, 122, 94};

// The marks; the legend shows the same.

void draw_heading(Canvas& canvas, const Pixel& from, double phi, const Color& color, double length = 13)
{
	const Pixel tip(from.x + length * std::cos(phi), from.y - length * std::sin(phi));
	const auto barb = [&](double side)
	{ return Pixel(tip.x + 5 * std::cos(phi + side), tip.y - 5 * std::sin(phi + side)); };
	canvas.line({from, tip}, 1.6, color);
	canvas.line({barb(-2.6), tip, barb(2.6)}, 1.6, color);
}

void draw_path(Canvas& canvas, const std::vector<Pixel>& points)
{
	canvas.line(points, 2.4, kPathColor);
	for (const Pixel& point : points) canvas.disc(point, 2.2, kPathColor);
}

/// Marks where the path begins. The path is drawn on it, the broad lines of ground truth and filter below it.
void draw_start(Canvas& canvas, const Pixel& at)
{
	std::vector<Pixel> ring;
	for (int i = 0; i <= 36; i++)
		ring.emplace_back(at.x + 9.5 * std::cos(i * M_PI / 18), at.y + 9.5 * std::sin(i * M_PI / 18));
	canvas.line(ring, 3, kStartColor);
}

void draw_truth(Canvas& canvas, const std::vector<Pixel>& points)
{
	canvas.line(points, 11, kTruthColor);
}

/// Broad enough to be seen on both sides of the path.
void draw_fused(Canvas& canvas, const std::vector<Pixel>& points)
{
	canvas.line(points, 6.5, kFusedColor);
}

void draw_reseed(Canvas& canvas, const Pixel& at)
{
	canvas.cross(at, 7, 6.5, kWhite);
	canvas.cross(at, 7, 3, kFusedColor);
}

void draw_hypothesis(Canvas& canvas, const Pixel& at, double probability)
{
	canvas.disc(at, 2 + 3 * std::sqrt(probability), kHypothesisColor, 0.75);
}

/// The best pose of an ambiguous frame: a ring, which differs from the discs of other hypotheses.
void draw_ambiguous(Canvas& canvas, const Pixel& at)
{
	canvas.disc(at, 6, kHypothesisColor);
	canvas.disc(at, 3.5, kWhite);
}

/// A localized frame that is off: the pose, and the way to where the robot was.
void draw_wrong(Canvas& canvas, const Pixel& pose, double phi, const Pixel& truth)
{
	canvas.line({truth, pose}, 5, kWhite, 0.8);
	canvas.line({truth, pose}, 2.4, kWrongColor);
	canvas.disc(pose, 9, kWhite);
	canvas.disc(pose, 7, kWrongColor);
	draw_heading(canvas, pose, phi, kWrongColor, 19);
	canvas.disc(truth, 4, kWrongColor);
}

void draw_wrong_pose(Canvas& canvas, const Pixel& pose, const Pixel& truth)
{
	canvas.line({truth, pose}, 1.4, kHypothesisColor, 0.7);
	canvas.cross(truth, 5, 2.4, kHypothesisColor);
}

void draw_without_pose(Canvas& canvas, const Pixel& truth)
{
	canvas.cross(truth, 5, 5, kWhite);
	canvas.cross(truth, 5, 2.4, kInk);
}

struct LegendEntry
{
	std::function<void(Canvas&, const Pixel& center)> draw_sample;
	std::string text;
};

/// The strip below a map: a scale bar and the entries, in as many rows as the width asks for.
class Legend
{
   public:
	Legend(std::vector<LegendEntry> entries, double pixels_per_metre, int width)
	    : entries_(std::move(entries)),
	      bar_metres_(round_length(kLongestBar * width / pixels_per_metre)),
	      bar_pixels_(bar_metres_ * pixels_per_metre)
	{
		Canvas ruler(1, 1, kWhite);
		const double first = kMargin + std::max(bar_pixels_, ruler.text_width(bar_text())) + kGap;
		double left = first;
		for (const auto& entry : entries_)
		{
			const double needed = kSampleWidth + ruler.text_width(entry.text);
			if (left + needed > width - kMargin && left > first)
			{
				left = first;
				rows_++;
			}
			slots_.push_back({left, rows_ - 1});
			left += needed + kGap;
		}
		rows_ = std::max(rows_, 2);
	}

	int height() const { return rows_ * kRowHeight + kMargin; }

	void draw(Canvas& canvas, int top) const
	{
		canvas.rectangle(0, top, canvas.width(), height(), kWhite);
		canvas.rectangle(0, top, canvas.width(), 1, kInk);
		draw_scale_bar(canvas, top + kMargin / 2 + kRowHeight / 2);
		for (std::size_t i = 0; i < entries_.size(); i++)
		{
			const double middle = top + kMargin / 2 + slots_[i].row * kRowHeight + kRowHeight / 2;
			entries_[i].draw_sample(canvas, Pixel(slots_[i].left + kSampleWidth / 2 - 5, middle));
			canvas.text(slots_[i].left + kSampleWidth, middle, entries_[i].text, kInk);
		}
	}

   private:
	struct Slot
	{
		double left;  //!< [pixel]
		int row;
	};

	std::string bar_text() const { return mrpt::format("%g m", bar_metres_); }

	void draw_scale_bar(Canvas& canvas, int middle) const
	{
		const double left = kMargin, right = kMargin + bar_pixels_;
		canvas.line({{left, middle - 6.0}, {left, middle + 6.0}}, 3, kInk);
		canvas.line({{left, 1.0 * middle}, {right, 1.0 * middle}}, 3, kInk);
		canvas.line({{right, middle - 6.0}, {right, middle + 6.0}}, 3, kInk);
		canvas.text(left, middle + kRowHeight - 4, bar_text(), kInk);
	}

	std::vector<LegendEntry> entries_;
	std::vector<Slot> slots_;
	double bar_metres_;  //!< [m]
	double bar_pixels_;  //!< [pixel]
	int rows_ = 1;
};

bool is_wrong(const Match& match)
{
	return !match.within(kTolerances.front());
}

std::string counted(const std::string& what, std::ptrdiff_t count)
{
	return what + " (" + std::to_string(count) + ")";
}

using DrawLine = void (*)(Canvas&, const std::vector<Pixel>&);

LegendEntry line_entry(DrawLine draw, const std::string& text)
{
	return {[draw](Canvas& canvas, const Pixel& at) { draw(canvas, {{at.x - 15, at.y}, {at.x + 15, at.y}}); }, text};
}

/// Counts the frames that have neither a pose nor ground truth.
std::ptrdiff_t count_without_place(const RunReport& report)
{
	std::set<const KeptFrame*> with_truth;
	for (const auto& m : report.matches) with_truth.insert(m.frame);
	return std::count_if(
	    report.frames.kept().begin(), report.frames.kept().end(),
	    [&](const KeptFrame& frame) { return !frame.has_pose && with_truth.count(&frame) == 0; });
}

void add_wrong(const RunReport& report, std::vector<LegendEntry>& entries)
{
	std::ptrdiff_t localized = 0, ambiguous = 0, without_pose = 0;
	for (const auto& m : report.matches)
		if (is_wrong(m)) (m.frame->localized() ? localized : m.frame->has_pose ? ambiguous : without_pose)++;
	const std::string off =
	    mrpt::format("localized, but off by %.1f m or %.0f deg", kTolerances.front().position, kTolerances.front().yaw);
	if (localized > 0)
		entries.push_back(
		    {[](Canvas& canvas, const Pixel& at) {
			     draw_wrong(canvas, {at.x, at.y}, 0, {at.x - 18, at.y});
		     },
		     counted(off, localized)});
	if (ambiguous > 0)
		entries.push_back(
		    {[](Canvas& canvas, const Pixel& at) {
			     draw_wrong_pose(canvas, {at.x + 15, at.y}, {at.x - 10, at.y});
		     },
		     counted("true place of an ambiguous frame whose best pose is off", ambiguous)});
	if (without_pose > 0) entries.push_back({draw_without_pose, counted("no pose, at its true place", without_pose)});
	if (const auto unknown = count_without_place(report); unknown > 0)
		entries.push_back({[](Canvas&, const Pixel&) {}, counted("rejected or invalid, not drawn", unknown)});
}

void add_fusion(const std::vector<KeptFrame>& frames, std::vector<LegendEntry>& entries)
{
	const auto is_fused = [](const KeptFrame& frame) { return frame.is_fused; };
	const auto is_reseeded = [](const KeptFrame& frame)
	{ return frame.is_fused && frame.event == FusionEvent::kReseeded; };
	if (std::any_of(frames.begin(), frames.end(), is_fused)) entries.push_back(line_entry(draw_fused, "fused"));
	const auto reseeds = std::count_if(frames.begin(), frames.end(), is_reseeded);
	if (reseeds > 0) entries.push_back({draw_reseed, counted("re-seeded", reseeds)});
}

/// Returns the hypotheses of a frame that are drawn as discs: those that are not the best.
std::vector<Hypothesis> drawn_hypotheses(const Frame& frame)
{
	std::vector<Hypothesis> drawn;
	for (std::size_t i = 1; i < frame.result.hypotheses.size(); i++)
		if (frame.result.hypotheses[i].probability >= kLeastDrawnProbability)
			drawn.push_back(frame.result.hypotheses[i]);
	return drawn;
}

void add_statuses(const RunReport& report, const DrawnFrames& frames, std::vector<LegendEntry>& entries)
{
	const auto counts = count_statuses(report.frames.kept());
	const auto localized = [](Canvas& canvas, const Pixel& at)
	{
		draw_path(canvas, {{at.x - 15, at.y}, {at.x + 15, at.y}});
		draw_heading(canvas, at, 0.9, kPathColor);
	};
	const auto other = [](Canvas& canvas, const Pixel& at) { draw_hypothesis(canvas, at, 1); };
	if (counts[0] > 0)
	{
		entries.push_back({localized, counted("localized", static_cast<std::ptrdiff_t>(counts[0])) + ", heading"});
		entries.push_back({draw_start, "start"});
	}
	bool has_hypotheses = false;
	frames.visit([&](const Frame& frame) { has_hypotheses = has_hypotheses || !drawn_hypotheses(frame).empty(); });
	if (counts[1] > 0)
		entries.push_back(
		    {draw_ambiguous, counted("ambiguous", static_cast<std::ptrdiff_t>(counts[1])) + ", best pose"});
	if (has_hypotheses) entries.push_back({other, "other hypotheses"});
}

/// Returns an entry for each kind of mark that is in the picture.
std::vector<LegendEntry> legend_entries(const RunReport& report, const DrawnFrames& frames)
{
	std::vector<LegendEntry> entries;
	add_statuses(report, frames, entries);
	add_wrong(report, entries);
	add_fusion(report.frames.kept(), entries);
	if (!report.matches.empty()) entries.push_back(line_entry(draw_truth, "ground truth of these frames"));
	return entries;
}

class Painter
{
   public:
	Painter(const RunReport& report, const DrawnFrames& frames, const MapView& view, Canvas& canvas)
	    : report_(report), frames_(frames), view_(view), canvas_(canvas)
	{
	}

	void paint_truth()
	{
		std::vector<Pixel> piece;
		const TimedPose* last = nullptr;
		for (const auto& m : report_.matches)
		{
			if (last && is_jump(last->robot, m.truth.robot, m.truth.time - last->time))
			{
				draw_truth(canvas_, piece);
				piece.clear();
			}
			piece.push_back(at(m.truth.robot));
			last = &m.truth;
		}
		draw_truth(canvas_, piece);
	}

	void paint_hypotheses()
	{
		frames_.visit(
		    [this](const Frame& frame)
		    {
			    for (const Hypothesis& h : drawn_hypotheses(frame))
				    draw_hypothesis(canvas_, at(h.pose.asTPose()), h.probability);
		    });
	}

	void paint_ambiguous()
	{
		for (const KeptFrame& frame : frames_.kept())
			if (frame.has_pose && !frame.localized()) draw_ambiguous(canvas_, at(frame.pose));
	}

	void paint_start()
	{
		const auto& kept = frames_.kept();
		const auto first =
		    std::find_if(kept.begin(), kept.end(), [](const KeptFrame& frame) { return frame.localized(); });
		if (first != kept.end()) draw_start(canvas_, at(first->pose));
	}

	void paint_path()
	{
		for (const auto& piece : path_pieces(frames_.kept()))
		{
			std::vector<Pixel> points;
			for (const KeptFrame* frame : piece) points.push_back(at(frame->pose));
			draw_path(canvas_, points);
			std::optional<Pixel> last;
			for (const KeptFrame* frame : piece)
			{
				if (last && (at(frame->pose) - *last).norm() < kTickSpacing) continue;
				last = at(frame->pose);
				draw_heading(canvas_, *last, frame->pose.phi, kPathColor);
			}
		}
	}

	void paint_fused()
	{
		std::vector<Pixel> piece;
		const KeptFrame* last = nullptr;
		for (const auto& frame : frames_.kept())
		{
			if (!last || !is_fused_onwards(*last, frame))
			{
				draw_fused(canvas_, piece);
				piece.clear();
			}
			if (frame.is_fused) piece.push_back(at(frame.fused));
			last = &frame;
		}
		draw_fused(canvas_, piece);
		for (const auto& frame : frames_.kept())
			if (frame.is_fused && frame.event == FusionEvent::kReseeded) draw_reseed(canvas_, at(frame.fused));
	}

	void paint_names(const std::vector<MapName>& names)
	{
		for (const MapName& map : names)
		{
			const Pixel start = view_.pixel(map.start.x, map.start.y);
			canvas_.text(start.x, start.y, map.name, kInk);
		}
	}

	/// Wrong localized frames come last, on top of all that might hide them.
	void paint_wrong()
	{
		for (const auto& m : report_.matches)
			if (is_wrong(m) && !m.frame->has_pose)
				draw_without_pose(canvas_, at(m.truth.robot));
			else if (is_wrong(m) && !m.frame->localized())
				draw_wrong_pose(canvas_, at(m.frame->pose), at(m.truth.robot));
		for (const auto& m : report_.matches)
			if (is_wrong(m) && m.frame->localized())
				draw_wrong(canvas_, at(m.frame->pose), m.frame->pose.phi, at(m.truth.robot));
	}

   private:
	Pixel at(const mrpt::math::TPose2D& pose) const { return view_.pixel(pose.x, pose.y); }

	const RunReport& report_;
	const DrawnFrames& frames_;
	const MapView& view_;
	Canvas& canvas_;
};

std::vector<mrpt::math::TPoint2D> places(
    const RunReport& report, const DrawnFrames& frames, const std::vector<MapName>& names)
{
	std::vector<mrpt::math::TPoint2D> points;
	for (const MapName& map : names) points.emplace_back(map.start.x, map.start.y + 0.49 * map.height);
	for (const auto& frame : frames.kept())
		if (frame.has_pose) points.emplace_back(frame.pose.x, frame.pose.y);
	for (const auto& m : report.matches) points.emplace_back(m.truth.robot.x, m.truth.robot.y);
	return points;
}
}  // namespace

void write_map_png(
    const RunReport& report, const DrawnFrames& frames, const Grid& map, const std::vector<MapName>& names,
    const PendingFile& file)
{
	const Grid grid = crop_for_picture(map, places(report, frames, names));
	MapView view = fit_view(grid, kLongSide, kLargestCell);
	const Axes axes(view);
	const int beside = axes.left_width() + kMargin;
	const int width = std::max(view.width + beside, kLeastWidth);
	const Legend legend(legend_entries(report, frames), view.scale, width);
	view.offset_x = axes.left_width() + (width - view.width - beside) / 2;
	view.offset_y = Axes::kTopHeight;
	const int legend_top = view.offset_y + view.height + Axes::kBottomHeight;

	Canvas canvas(width, legend_top + legend.height(), kPaper);
	canvas.greys(map_greys(grid, view), view.width, view.offset_x, view.offset_y);
	Painter painter(report, frames, view, canvas);
	painter.paint_truth();
	painter.paint_fused();
	painter.paint_start();
	painter.paint_hypotheses();
	painter.paint_ambiguous();
	painter.paint_path();
	painter.paint_wrong();
	painter.paint_names(names);
	axes.draw(canvas, view);
	legend.draw(canvas, legend_top);
	if (!canvas.save(file.temporary())) file.fail();
}
}  // namespace d2s1r::app
