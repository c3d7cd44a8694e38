// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <base/errors.h>
#include <gtest/gtest.h>

#include <new>
#include <stdexcept>

namespace d2s1r::test
{
TEST(Printable, LeavesNothingThatControlsATerminal)
{
	EXPECT_EQ(printable("a\x1b[31mb\n\t\x7f"), "a?[31mb???");
	EXPECT_EQ(printable(std::string("a\0b", 3)), "a?b");
	EXPECT_EQ(
	    printable("a\xc2\x9b"
	              "b\xc2\x85"),
	    "a?b?")
	    << "U+009B and U+0085";
}

TEST(Printable, LeavesNothingThatTurnsTheDirectionOfAText)
{
	EXPECT_EQ(printable("a\xe2\x80\xaegpj.exe"), "a?gpj.exe") << "U+202E";
	EXPECT_EQ(printable("\xe2\x80\x8f\xe2\x81\xa6\xe2\x80\xa8\xd8\x9c"), "????") << "U+200F, U+2066, U+2028, U+061C";
	EXPECT_EQ(printable("\xe2\x80\x93\xe2\x81\xa5\xe2\x80"), "\xe2\x80\x93\xe2\x81\xa5\xe2\x80")
	    << "a dash, and others";
}

TEST(Printable, KeepsTheLettersOfAllLanguages)
{
	for (const std::string text :
	     {"Gr\xc3\xbc\xc3\x9f"
	      "e",
	      "\xe5\x9c\xb0\xe5\x9b\xb3.yaml", "\xc2\xa0", ""})
		EXPECT_EQ(printable(text), text);
}

TEST(Excerpt, IsShortAndAscii)
{
	EXPECT_EQ(excerpt("key = \xe4\n"), "key = ??");
	EXPECT_EQ(excerpt(std::string(60, 'x')), std::string(60, 'x'));
	EXPECT_EQ(excerpt(std::string(61, 'x')), std::string(60, 'x') + "...");
}

TEST(OutOfMemory, IsToldByLibrariesInWaysOfTheirOwnButNotByAnInput)
{
	EXPECT_TRUE(is_out_of_memory(std::bad_alloc()));
	EXPECT_TRUE(is_out_of_memory(std::runtime_error("std::bad_alloc")));
	EXPECT_TRUE(is_out_of_memory(std::runtime_error("(-4:Insufficient memory) in function 'OutOfMemoryError'")));
	EXPECT_FALSE(is_out_of_memory(std::runtime_error("has 'bad_alloc' where a number belongs")));
	EXPECT_FALSE(is_out_of_memory(std::runtime_error("has 'a' bad_alloc 'b' where a number belongs")));
}
}  // namespace d2s1r::test
