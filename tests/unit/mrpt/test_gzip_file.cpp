// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/gzip_file.h>
#include <mrpt/poses/CPose2D.h>

#include "app/temporary_folder.h"

using namespace d2s1r;

class OutputGzipFile : public d2s1r::test::FolderTest
{
};

TEST_F(OutputGzipFile, IsRemovedIfItIsNotCommitted)
{
	{
		const GzipFile gzip(path("b.gz"));
		EXPECT_EQ(count(), 1);
	}
	EXPECT_EQ(count(), 0);
}

TEST_F(OutputGzipFile, IsNotWholeIfItWasCutShort)
{
	GzipFile file(path("a.gz"));
	file.write(mrpt::poses::CPose2D(1, 2, 3));
	file.commit();
	EXPECT_TRUE(is_whole_gzip(path("a.gz")));
	const std::string whole = read("a.gz");
	for (std::size_t size = 0; size < whole.size(); size++)
	{
		write("cut.gz", whole.substr(0, size));
		EXPECT_FALSE(is_whole_gzip(path("cut.gz"))) << size;
	}
}
