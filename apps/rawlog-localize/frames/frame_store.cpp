// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "frames/frame_store.h"

#include <algorithm>
#include <limits>
#include <type_traits>

namespace d2s1r::app
{
namespace
{
/// Writes values to the file. Writer and Reader have the same calls, so that one list of the members of a frame serves
/// both: see exchange().
class Writer
{
   public:
	explicit Writer(SpillFile& file) : file_(file) {}

	template <class Number>
	void number(const Number& value)
	{
		static_assert(std::is_trivially_copyable_v<Number>, "other types have members that point elsewhere");
		file_.write(&value, sizeof value);
	}
	void text(const std::string& text)
	{
		number(text.size());
		file_.write(text.data(), text.size());
	}
	void pose(const mrpt::poses::CPose2D& pose) { number(pose.asTPose()); }

	/// Returns whether there is a value, after making one if the file has one.
	template <class Value>
	bool has_value(const std::optional<Value>& value)
	{
		number(value.has_value());
		return value.has_value();
	}
	template <class Value>
	void size_of(const std::vector<Value>& list)
	{
		number(list.size());
	}

   private:
	SpillFile& file_;
};

class Reader
{
   public:
	explicit Reader(SpillFile& file) : file_(file) {}

	template <class Number>
	void number(Number& value)
	{
		if (file_.read(&value, sizeof value) != sizeof value) value = {};  // it has what was written to it
	}
	void text(std::string& text)
	{
		std::size_t size = 0;
		number(size);
		text.resize(size);
		file_.read(text.data(), size);
	}
	void pose(mrpt::poses::CPose2D& pose)
	{
		mrpt::math::TPose2D numbers;
		number(numbers);
		pose = mrpt::poses::CPose2D(numbers);
	}
	template <class Value>
	bool has_value(std::optional<Value>& value)
	{
		bool has = false;
		number(has);
		if (has)
			value.emplace();
		else
			value.reset();
		return has;
	}
	template <class Value>
	void size_of(std::vector<Value>& list)
	{
		std::size_t size = 0;
		number(size);
		list.resize(size);
	}

   private:
	SpillFile& file_;
};

template <class Archive, class AnyHypothesis>
void exchange_hypothesis(Archive& archive, AnyHypothesis& hypothesis)
{
	archive.pose(hypothesis.pose);
	for (int row = 0; row < 3; row++)
		for (int column = 0; column < 3; column++) archive.number(hypothesis.covariance(row, column));
	archive.number(hypothesis.probability);
	if (archive.has_value(hypothesis.explained)) archive.number(*hypothesis.explained);
	archive.text(hypothesis.map);
}

template <class Archive, class AnyResult>
void exchange_result(Archive& archive, AnyResult& result)
{
	archive.number(result.status);
	archive.number(result.confidence);
	archive.number(result.times.total_ms);
	archive.text(result.note);
	archive.size_of(result.hypotheses);
	for (auto& hypothesis : result.hypotheses) exchange_hypothesis(archive, hypothesis);
}

/// Writes a frame, or reads it, member by member.
template <class Archive, class AnyFrame>
void exchange(Archive& archive, AnyFrame& frame)
{
	archive.number(frame.index);
	archive.number(frame.timestamp);
	exchange_result(archive, frame.result);
	if (archive.has_value(frame.alone)) exchange_result(archive, *frame.alone);
	if (archive.has_value(frame.tracked)) exchange_result(archive, *frame.tracked);
	if (!archive.has_value(frame.fused)) return;
	archive.number(frame.fused->status);
	archive.number(frame.fused->event);
	archive.text(frame.fused->map);
	archive.number(frame.fused->pose);
	archive.number(frame.fused->probability);
}
}  // namespace

KeptFrame keep(const Frame& frame)
{
	KeptFrame kept;
	kept.timestamp = frame.timestamp;
	kept.status = frame.result.status;
	kept.times = frame.result.times;
	kept.has_pose = frame.has_pose();
	if (kept.has_pose) kept.pose = frame.result.best().pose.asTPose();
	if (frame.tracker) kept.verdict = frame.tracker->scan.verdict;
	kept.is_fused = frame.fused.has_value();
	if (!kept.is_fused) return kept;
	kept.fused = frame.fused->pose;
	kept.fusion_status = frame.fused->status;
	kept.event = frame.fused->event;
	kept.step_ms = frame.fused->step_ms;
	return kept;
}

void FrameStore::add(const Frame& frame)
{
	Writer writer(file_);
	exchange(writer, frame);
	KeptFrame& kept = kept_.emplace_back(keep(frame));
	if (kept.has_pose) kept.map = number_of(frame.result.best().map);
	if (frame.tracked)
	{
		KeptTrack& track = tracked_.emplace_back(KeptTrack{frame.tracked->status, {}, frame.tracked->times.total_ms});
		if (!frame.tracked->hypotheses.empty()) track.pose = frame.tracked->best().pose.asTPose();
	}
	if (kept.is_fused) kept.fused_map = number_of(frame.fused->map);
	if (!frame.result.note.empty()) notes_[frame.result.status][frame.result.note]++;
}

const std::map<std::string, std::size_t>& FrameStore::notes(Status status) const
{
	static const std::map<std::string, std::size_t> kNone;
	const auto found = notes_.find(status);
	return found != notes_.end() ? found->second : kNone;
}

void FrameStore::visit(const std::function<void(const Frame&)>& look) const
{
	file_.rewind();
	Reader reader(file_);
	for (std::size_t i = 0; i < kept_.size(); i++)
	{
		Frame frame;
		exchange(reader, frame);
		look(frame);
	}
}

std::uint16_t FrameStore::number_of(const std::string& map)
{
	const auto found = std::find(map_names_.begin(), map_names_.end(), map);
	const auto number = static_cast<std::uint16_t>(found - map_names_.begin());
	if (found == map_names_.end()) map_names_.push_back(map);
	return number;
}
}  // namespace d2s1r::app
