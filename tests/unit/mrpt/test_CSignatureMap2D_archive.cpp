// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/map_io.h>
#include <gtest/gtest.h>
#include <mrpt/io/CMemoryStream.h>
#include <mrpt/poses/CPose3D.h>
#include <mrpt/serialization/CArchive.h>

#include "mrpt_grid.h"
#include "signature_map_room.h"
#include "test_files.h"

namespace d2s1r::test
{
namespace
{
using mrpt::poses::CPose3D;

std::vector<std::uint8_t> serialized(const CSignatureMap2D& map)
{
	mrpt::io::CMemoryStream stream;
	mrpt::serialization::archiveFrom(stream) << map;
	const auto* bytes = static_cast<const std::uint8_t*>(stream.getRawBufferData());
	return {bytes, bytes + stream.getTotalBytesCount()};
}

CSignatureMap2D deserialized(const std::vector<std::uint8_t>& bytes)
{
	mrpt::io::CMemoryStream stream(bytes.data(), bytes.size());
	CSignatureMap2D map;
	mrpt::serialization::archiveFrom(stream) >> map;
	return map;
}

TEST(SignatureMapArchive, ComesBackFromAnArchive)
{
	Parameters parameters;
	parameters.paper.bins = 40;
	CSignatureMap2D::TLikelihoodOptions likelihood;
	likelihood.sigma = 0.1234567891234;
	CSignatureMap2D map(*make_mrpt_map(kGrid), parameters, likelihood);
	map.genericMapParams.enableObservationInsertion = false;
	map.insertionOptions.maxDistanceInsertion = 5;

	const CSignatureMap2D read = deserialized(serialized(map));
	EXPECT_EQ(read.fingerprint(), map.fingerprint());
	EXPECT_EQ(read.parameters().paper.bins, 40);
	EXPECT_EQ(read.likelihood_options().sigma, likelihood.sigma);
	EXPECT_FALSE(read.genericMapParams.enableObservationInsertion);
	EXPECT_EQ(read.grid()->getRawMap(), map.grid()->getRawMap());
	const auto scan = make_mrpt_observation(kGrid, kTruth);
	EXPECT_EQ(
	    read.computeObservationLikelihood(scan, CPose3D(kTruth)),
	    map.computeObservationLikelihood(scan, CPose3D(kTruth)));
	EXPECT_EQ(read.insertionOptions.maxDistanceInsertion, 5);
}

TEST(SignatureMapArchive, AnEmptyOneComesBackWithItsOptions)
{
	CSignatureMap2D map;
	map.insertionOptions.maxDistanceInsertion = 5;
	const CSignatureMap2D read = deserialized(serialized(map));
	EXPECT_TRUE(read.isEmpty());
	EXPECT_EQ(read.insertionOptions.maxDistanceInsertion, 5);
}

TEST(SignatureMapArchive, ComesBackExactlyWhereItWas)
{
	for (const double origin : {-5.013, -0.05, 0.05, 0.15, 3.021})
	{
		const auto grid = make_mrpt_map(kGrid);
		set_origin(*grid, origin, -origin);
		const CSignatureMap2D map(*grid);
		const CSignatureMap2D read = deserialized(serialized(map));
		EXPECT_EQ(read.fingerprint(), map.fingerprint()) << origin;
		EXPECT_EQ(read.grid()->getXMin(), static_cast<float>(origin));
		EXPECT_EQ(read.grid()->getYMin(), static_cast<float>(-origin));
		EXPECT_EQ(read.grid()->getSizeX(), map.grid()->getSizeX()) << origin;
		EXPECT_EQ(read.grid()->getRawMap(), map.grid()->getRawMap()) << origin;
	}
}

TEST(SignatureMapArchive, ComesBackFromWhereFloatsAreCoarse)
{
	const auto grid = make_mrpt_map(make_picture_grid({"#####", "#...#", "#####"}, 0.01));
	for (const double origin : {30e3, -65e3, 99e3})
	{
		set_origin(*grid, origin, -origin);
		const CSignatureMap2D map(*grid);
		const CSignatureMap2D read = deserialized(serialized(map));
		EXPECT_EQ(read.fingerprint(), map.fingerprint()) << origin;
		EXPECT_EQ(read.grid()->getSizeX(), map.grid()->getSizeX()) << origin;
		EXPECT_EQ(read.grid()->getXMin(), map.grid()->getXMin()) << origin;
	}
}

TEST(SignatureMapArchive, RefusesAnArchiveThatDoesNotFitItsFingerprint)
{
	auto bytes = serialized(make_signature_map());
	auto& cell = bytes[bytes.size() - kGrid.cells.size() / 2];
	cell = static_cast<std::uint8_t>(cell + 1);
	try
	{
		deserialized(bytes);
		FAIL() << "a changed grid was accepted";
	}
	catch (const std::exception& error)
	{
		EXPECT_NE(std::string(error.what()).find("fingerprint"), std::string::npos) << error.what();
	}
}

TEST(SignatureMapArchive, RefusesAnArchiveOfAnotherVersion)
{
	auto bytes = serialized(make_signature_map());
	const std::string name = "CSignatureMap2D";
	const auto version =
	    std::search(bytes.begin(), bytes.end(), name.begin(), name.end()) + static_cast<std::ptrdiff_t>(name.size());
	EXPECT_EQ(int{*version}, 1);
	*version = 2;
	EXPECT_NE(
	    message_of<std::exception>([&] { deserialized(bytes); }).find("another version of d2s1r"), std::string::npos);
}

TEST(SignatureMapArchive, IsAMapFile)
{
	const auto map = make_signature_map();
	const auto bytes = serialized(map);
	const TempFolder folder;
	const auto loaded = load_map(folder.write("saved.signaturemap", {bytes.begin(), bytes.end()}));
	EXPECT_EQ(loaded->cells, map.grid()->getRawMap());
}

/// Expects that a map file of these bytes is refused for that reason, in one line.
void expect_refused_map_file(const std::vector<std::uint8_t>& bytes, const std::string& reason)
{
	const TempFolder folder;
	const std::string file = folder.write("damaged.signaturemap", {bytes.begin(), bytes.end()});
	const std::string message = message_of<std::runtime_error>([&] { load_map(file); });
	EXPECT_EQ(message.rfind(file + ": ", 0), 0U) << message;
	EXPECT_NE(message.find(reason), std::string::npos) << message;
	EXPECT_EQ(message.find('\n'), std::string::npos) << message;
}

TEST(SignatureMapArchive, ADamagedMapFileIsRefusedAloud)
{
	auto bytes = serialized(make_signature_map());
	auto& cell = bytes[bytes.size() - kGrid.cells.size() / 2];
	cell = static_cast<std::uint8_t>(cell + 1);
	expect_refused_map_file(bytes, "fingerprint");
	bytes.resize(bytes.size() / 2);
	expect_refused_map_file(bytes, "truncated");
}

TEST(SignatureMapArchive, AMapFileWithOtherParametersSaysWhichOneItIs)
{
	const auto saved = serialized(make_signature_map());
	const auto with = [&saved](const std::string& text, const std::string& instead)
	{
		std::string bytes(saved.begin(), saved.end());
		bytes.replace(bytes.find(text), text.size(), instead);
		return std::vector<std::uint8_t>(bytes.begin(), bytes.end());
	};
	expect_refused_map_file(with("bins =", "bits ="), "paper.bits");
	expect_refused_map_file(with("bins = 60", "bins = 01"), "paper.bins");
	expect_refused_map_file(with("bins = 60", "bins = 61"), "fingerprint");
	expect_refused_map_file(with("=  0.1 ", "= -0.1 "), "sigma");
}
}  // namespace
}  // namespace d2s1r::test
