// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Two robots of one name are told from one robot whose nodes were started again, and peers that have gone are
// forgotten.
#include <gtest/gtest.h>
#include <unistd.h>

#include <thread>

#include "dds.h"
#include "line_budget.h"
#include "rivals.h"
#include "ros.h"

namespace d2s1r::live
{
namespace
{
SteadyTime after(double seconds)
{
	return SteadyTime() + std::chrono::milliseconds(1'000'000 + static_cast<int>(1000 * seconds));
}
}  // namespace

TEST(Rivals, AreTwoThatSpeakByTurns)
{
	Rivals rivals;
	for (int i = 0; i < 4; i++) rivals.hear("/scan", 1, after(0.1 * i));
	rivals.hear("/odom", 7, after(0.4));
	EXPECT_EQ(rivals.thing(after(0.4)), "");
	rivals.hear("/scan", 2, after(0.45));
	EXPECT_EQ(rivals.thing(after(0.45)), "") << "it may have taken the other one's place";
	rivals.hear("/scan", 1, after(0.5));
	EXPECT_EQ(rivals.thing(after(0.5)), "/scan");
	EXPECT_EQ(rivals.thing(after(60)), "") << "one of them has gone";
}

TEST(Rivals, ANodeThatWasStartedAgainIsNone)
{
	Rivals rivals;
	for (int crash = 1; crash < 5; crash++)
		for (int i = 0; i < 10; i++) rivals.hear("/scan", static_cast<std::uint64_t>(crash), after(crash + 0.1 * i));
	EXPECT_EQ(rivals.thing(after(5)), "");
}

TEST(Rivals, TwoThatSayTheSameAreNone)
{
	Rivals same, other;
	for (int i = 0; i < 20; i++)
	{
		const auto publisher = static_cast<std::uint64_t>(1 + i % 2);
		const mrpt::poses::CPose2D place(0.05 * i, 0, 0), far(0.05 * i + 5 * (i % 2), 0, 0);
		same.hear("base_link", publisher, place, after(0.1 * i));
		other.hear("base_link", publisher, far, after(0.1 * i));
	}
	EXPECT_EQ(same.thing(after(2)), "");
	EXPECT_EQ(other.thing(after(2)), "base_link");
}

TEST(Rivals, AreNoticedAmongAnyNumberOfThings)
{
	Rivals rivals;
	for (int i = 0; i < 5; i++)
	{
		rivals.hear("/scan", static_cast<std::uint64_t>(1 + i % 2), after(0.1 * i));
		for (int k = 0; k < 150; k++) rivals.hear("f" + std::to_string(150 * i + k), 3, after(0.1 * i));
	}
	EXPECT_EQ(rivals.thing(after(0.5)), "/scan");
}

TEST(LineBudget, IsThatOfEachPeer)
{
	LineBudget budget;
	const std::string line(1000, 'x');
	int lines = 0, bytes = 0;
	for (int i = 0; i < 10'000; i++)
	{
		const std::string passed = budget.pass(1, line, after(0.01 * i));
		lines += passed.empty() ? 0 : 1;
		bytes += static_cast<int>(passed.size());
	}
	EXPECT_EQ(lines, 39) << "30 at once, and one each 10 s";
	EXPECT_LT(bytes, 20'000);
	EXPECT_EQ(budget.pass(2, "of another one", after(100)), "of another one");
	const std::string last = budget.pass(1, "of the first one", after(200));
	EXPECT_EQ(last, "(999 lines were left out before this one) of the first one");
}

TEST(LineBudget, IsThatOfAllPeersTogether)
{
	LineBudget budget;
	int lines = 0;
	for (int i = 0; i < 10'000; i++)
		lines += budget.pass(static_cast<std::uint64_t>(i), "line", after(0.01 * i)).empty() ? 0 : 1;
	EXPECT_LE(lines, 400) << "300 at once, and one each second";
	EXPECT_GE(lines, 300);
}

TEST(TrackerCount, TellsTwoTrackersFromOneThatWasStartedAgain)
{
	TrackerCount both;
	EXPECT_FALSE(both.are_several(0, after(0)));
	EXPECT_FALSE(both.are_several(1, after(1)));
	EXPECT_TRUE(both.are_several(2, after(2))) << "they were there from the beginning";
	TrackerCount restarted;
	for (int second = 0; second < 20; second++) EXPECT_FALSE(restarted.are_several(1, after(second)));
	for (int second = 20; second < 30; second++) EXPECT_FALSE(restarted.are_several(2, after(second)));
	EXPECT_FALSE(restarted.are_several(3, after(30))) << "again";
	EXPECT_FALSE(restarted.are_several(2, after(40)));
	EXPECT_TRUE(restarted.are_several(2, after(60))) << "the second one lives";
	EXPECT_FALSE(restarted.are_several(1, after(61)));
}

TEST(Publications, ForgetWhatHasGone)
{
	const std::uint32_t domain = 20 + static_cast<std::uint32_t>(getpid()) % 80;
	const Entity opened = open_domain(domain, {""}), own = join_domain(domain);
	Publications publications(own);
	const auto wait_for = [&](std::size_t count)
	{
		for (int i = 0; i < 100 && publications.all().size() != count; i++)
		{
			std::this_thread::sleep_for(std::chrono::milliseconds(50));
			publications.update();
		}
		return publications.all().size();
	};
	const auto name = [](int i) { return "/x" + std::to_string(i); };
	for (int round = 0; round < 3; round++)
	{
		{
			const Entity peer = join_domain(domain);
			std::vector<AnyWriter> writers;
			for (int i = 0; i < 500; i++)
				writers.emplace_back(Place{peer}, std_msgs_msg_dds__Empty__desc, name(500 * round + i), Quality{});
			EXPECT_EQ(wait_for(500), 500U);
			EXPECT_EQ(publications.topics_of("std_msgs::msg::dds_::Empty_", name(500 * round)).size(), 499U);
		}
		EXPECT_EQ(wait_for(0), 0U);
	}
}
}  // namespace d2s1r::live
