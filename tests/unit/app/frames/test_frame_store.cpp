// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <shell/errors.h>

#include "../temporary_folder.h"
#include "frames/frame_store.h"

namespace d2s1r::test
{
namespace
{
using app::Frame;
using app::FrameStore;

Hypothesis hypothesis_at(double x, const std::string& map)
{
	Hypothesis hypothesis;
	hypothesis.pose = mrpt::poses::CPose2D(x, -x, 0.1 * x);
	for (int row = 0; row < 3; row++)
		for (int column = 0; column < 3; column++) hypothesis.covariance(row, column) = x + row * 3 + column;
	hypothesis.probability = 0.5;
	hypothesis.explained = x > 1 ? std::optional(0.75) : std::nullopt;
	hypothesis.map = map;
	return hypothesis;
}

/// A frame with as many hypotheses as its index says, every other one of map "b"; without one it has a note.
Frame frame_of(std::size_t index)
{
	Frame frame;
	frame.index = index;
	frame.timestamp = 1e9 + 0.125 * static_cast<double>(index);
	frame.result.status = index > 0 ? Status::kLocalized : Status::kRejected;
	frame.result.confidence = 0.25;
	frame.result.times.total_ms = 7;
	if (index == 0) frame.result.note = "nothing fits";
	for (std::size_t i = 0; i < index; i++)
		frame.result.hypotheses.push_back(hypothesis_at(static_cast<double>(i + 1), i % 2 == 0 ? "a" : "b"));
	if (index == 1) frame.alone = frame_of(3).result;
	if (index != 2) return frame;
	frame.fused.emplace();
	frame.fused->map = "c";
	frame.fused->pose = {1, 2, 3};
	frame.fused->status = FusionStatus::kTracking;
	frame.fused->event = FusionEvent::kReseeded;
	frame.fused->probability = 0.875;
	return frame;
}

void expect_same(const Localization& read, const Localization& added)
{
	EXPECT_EQ(read.status, added.status);
	EXPECT_EQ(read.confidence, added.confidence);
	EXPECT_EQ(read.times.total_ms, added.times.total_ms);
	EXPECT_EQ(read.note, added.note);
	ASSERT_EQ(read.hypotheses.size(), added.hypotheses.size());
	for (std::size_t i = 0; i < read.hypotheses.size(); i++)
	{
		EXPECT_EQ(read.hypotheses[i].pose.asTPose(), added.hypotheses[i].pose.asTPose());
		EXPECT_EQ(read.hypotheses[i].covariance, added.hypotheses[i].covariance);
		EXPECT_EQ(read.hypotheses[i].probability, added.hypotheses[i].probability);
		EXPECT_EQ(read.hypotheses[i].explained, added.hypotheses[i].explained);
		EXPECT_EQ(read.hypotheses[i].map, added.hypotheses[i].map);
	}
}

class FrameStoreTest : public FolderTest
{
};
}  // namespace

TEST_F(FrameStoreTest, GivesBackWhatWasAddedAsOftenAsItIsAsked)
{
	FrameStore store(path("."));
	for (std::size_t i = 0; i < 4; i++) store.add(frame_of(i));
	for (int time = 0; time < 2; time++)
	{
		std::size_t count = 0;
		store.visit(
		    [&](const Frame& frame)
		    {
			    const Frame added = frame_of(count++);
			    EXPECT_EQ(frame.index, added.index);
			    EXPECT_EQ(frame.timestamp, added.timestamp);
			    expect_same(frame.result, added.result);
			    ASSERT_EQ(frame.alone.has_value(), added.alone.has_value());
			    if (frame.alone) expect_same(*frame.alone, *added.alone);
			    ASSERT_EQ(frame.fused.has_value(), added.fused.has_value());
			    if (!frame.fused) return;
			    EXPECT_EQ(frame.fused->pose, added.fused->pose);
			    EXPECT_EQ(frame.fused->map, "c");
			    EXPECT_EQ(frame.fused->event, FusionEvent::kReseeded);
			    EXPECT_EQ(frame.fused->probability, 0.875);
		    });
		EXPECT_EQ(count, 4U);
	}
}

TEST_F(FrameStoreTest, KeepsInMemoryWhereTheRobotWasAndWhatIsCounted)
{
	FrameStore store(path("."));
	for (std::size_t i = 0; i < 4; i++) store.add(frame_of(i));
	ASSERT_EQ(store.kept().size(), 4U);
	EXPECT_LE(sizeof(app::KeptFrame), 120U);
	EXPECT_FALSE(store.kept()[0].has_pose);
	EXPECT_EQ(store.kept()[1].pose, frame_of(1).result.best().pose.asTPose());
	EXPECT_EQ(store.map_names()[store.kept()[1].map], "a");
	EXPECT_EQ(store.map_names()[store.kept()[2].fused_map], "c");
	EXPECT_EQ(store.notes(Status::kRejected).at("nothing fits"), 1U);
	EXPECT_TRUE(store.notes(Status::kInvalid).empty());
	EXPECT_EQ(count(), 0) << "the file has no name";
}

TEST_F(FrameStoreTest, SaysThatItsFolderCannotHoldIt)
{
	FrameStore store(path("none"));
	EXPECT_THROW(store.add(frame_of(1)), app::UserError);
}
}  // namespace d2s1r::test
