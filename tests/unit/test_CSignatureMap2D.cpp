// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/CSignatureMap2D.h>
#include <d2s1r/map_io.h>
#include <gtest/gtest.h>
#include <mrpt/config/CConfigFileMemory.h>
#include <mrpt/io/CMemoryStream.h>
#include <mrpt/maps/CMultiMetricMap.h>
#include <mrpt/maps/CSimpleMap.h>
#include <mrpt/maps/CSimplePointsMap.h>
#include <mrpt/obs/CObservationOdometry.h>
#include <mrpt/opengl/CSetOfObjects.h>
#include <mrpt/poses/CPose3DPDFGaussian.h>
#include <mrpt/serialization/CArchive.h>

#include <fstream>
#include <thread>

#include "occupancy_map.h"
#include "test_files.h"
#include "test_maps.h"

using d2s1r::CSignatureMap2D;
using mrpt::poses::CPose3D;

namespace
{
const d2s1r::Grid kGrid = d2s1r::test::make_picture_grid(
    d2s1r::test::enlarge(
        {"##############",  //
         "#............#",  //
         "#............#",  //
         "#....##......#",  //
         "#............#",  //
         "#............#",  //
         "##############"},
        5),
    0.1);
const mrpt::math::TPose2D kTruth = {2.3, 1.2, 0.4};  // robot in map

CSignatureMap2D make_signature_map()
{
	return CSignatureMap2D(*d2s1r::test::make_map(kGrid));
}

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

mrpt::maps::CMultiMetricMap from_ini(const std::string& ini)
{
	mrpt::maps::TSetOfMetricMapInitializers definition;
	definition.loadFromConfigFile(mrpt::config::CConfigFileMemory(ini), "Maps");
	mrpt::maps::CMultiMetricMap maps;
	maps.setListOfMaps(definition);
	return maps;
}

TEST(CSignatureMap2D, LikelihoodIsGreatestAtTheTruthAndFiniteAnywhere)
{
	const auto map = make_signature_map();
	const auto scan = d2s1r::test::make_observation(kGrid, kTruth);
	const double at_truth = map.computeObservationLikelihood(scan, CPose3D(kTruth));
	for (const double offset : {-0.5, 0.5, 1e5})
	{
		const double elsewhere =
		    map.computeObservationLikelihood(scan, CPose3D(kTruth) + CPose3D(offset, -offset, 0, 0.1, 0, 0));
		EXPECT_TRUE(std::isfinite(elsewhere));
		EXPECT_LT(elsewhere, at_truth - 1);
	}
}

TEST(CSignatureMap2D, LikelihoodFollowsTheObservationNotItsAddress)
{
	const auto map = make_signature_map();
	auto scan = d2s1r::test::make_observation(kGrid, kTruth);
	const double first = map.computeObservationLikelihood(scan, CPose3D(kTruth));
	for (std::size_t i = 0; i < scan.getScanSize(); i++) scan.setScanRange(i, 0.5F * scan.getScanRange(i));
	const double shortened = map.computeObservationLikelihood(scan, CPose3D(kTruth));
	EXPECT_LT(shortened, first);
	for (std::size_t i = 0; i < scan.getScanSize(); i++) scan.setScanRangeValidity(i, false);
	EXPECT_EQ(map.computeObservationLikelihood(scan, CPose3D(kTruth)), 0.0);
	EXPECT_EQ(make_signature_map().computeObservationLikelihood(scan, CPose3D(kTruth)), 0.0);
}

TEST(CSignatureMap2D, BeamsTooFewToFindAPlaceByStillWeighPoses)
{
	const auto map = make_signature_map();
	auto scan = d2s1r::test::make_observation(kGrid, kTruth);
	for (std::size_t i = 0; i < scan.getScanSize(); i++) scan.setScanRangeValidity(i, i % 40 == 0);
	ASSERT_FALSE(make_scan(scan, map.parameters().scan).valid());
	EXPECT_GT(
	    map.computeObservationLikelihood(scan, CPose3D(kTruth)),
	    map.computeObservationLikelihood(scan, CPose3D(kTruth) + CPose3D(0.5, 0.5, 0, 0, 0, 0)) + 1);
}

TEST(CSignatureMap2D, RefusesALikelihoodOutOfRange)
{
	CSignatureMap2D::TLikelihoodOptions likelihood;
	likelihood.beams = 0;
	EXPECT_THROW(CSignatureMap2D({}, likelihood), std::invalid_argument);
}

TEST(CSignatureMap2D, OnlyScansHaveALikelihood)
{
	const auto map = make_signature_map();
	EXPECT_TRUE(map.canComputeObservationLikelihood(d2s1r::test::make_observation(kGrid, kTruth)));
	EXPECT_FALSE(map.canComputeObservationLikelihood(mrpt::obs::CObservationOdometry()));
	EXPECT_EQ(map.computeObservationLikelihood(mrpt::obs::CObservationOdometry(), CPose3D()), 0.0);
	EXPECT_FALSE(CSignatureMap2D().canComputeObservationLikelihood(d2s1r::test::make_observation(kGrid, kTruth)));
}

TEST(CSignatureMap2D, LikelihoodIsTheSameFromManyThreads)
{
	const auto map = make_signature_map();
	const auto scan = d2s1r::test::make_observation(kGrid, kTruth);
	std::vector<double> values(8);
	std::vector<std::thread> threads;
	for (double& value : values)
		threads.emplace_back([&] { value = map.computeObservationLikelihood(scan, CPose3D(kTruth)); });
	for (auto& thread : threads) thread.join();
	const double alone = make_signature_map().computeObservationLikelihood(scan, CPose3D(kTruth));
	for (const double value : values) EXPECT_EQ(value, alone);
}

TEST(CSignatureMap2D, ComesBackFromAnArchive)
{
	d2s1r::Parameters parameters;
	parameters.paper.bins = 40;
	CSignatureMap2D::TLikelihoodOptions likelihood;
	likelihood.sigma = 0.25;
	CSignatureMap2D map(*d2s1r::test::make_map(kGrid), parameters, likelihood);
	map.genericMapParams.enableObservationInsertion = false;

	const CSignatureMap2D read = deserialized(serialized(map));
	EXPECT_EQ(read.fingerprint(), map.fingerprint());
	EXPECT_EQ(read.parameters().paper.bins, 40);
	EXPECT_EQ(read.likelihood_options().sigma, 0.25);
	EXPECT_FALSE(read.genericMapParams.enableObservationInsertion);
	EXPECT_EQ(read.grid()->getRawMap(), map.grid()->getRawMap());
	const auto scan = d2s1r::test::make_observation(kGrid, kTruth);
	EXPECT_EQ(
	    read.computeObservationLikelihood(scan, CPose3D(kTruth)),
	    map.computeObservationLikelihood(scan, CPose3D(kTruth)));
	EXPECT_TRUE(deserialized(serialized(CSignatureMap2D())).isEmpty());
}

TEST(CSignatureMap2D, ComesBackExactlyWhereItWas)
{
	for (const double origin : {-5.013, -0.05, 0.05, 0.15, 3.021})
	{
		const auto grid = d2s1r::test::make_map(kGrid);
		d2s1r::set_origin(*grid, origin, -origin);
		const CSignatureMap2D map(*grid);
		const CSignatureMap2D read = deserialized(serialized(map));
		EXPECT_EQ(read.fingerprint(), map.fingerprint()) << origin;
		EXPECT_EQ(read.grid()->getXMin(), static_cast<float>(origin));
		EXPECT_EQ(read.grid()->getYMin(), static_cast<float>(-origin));
		EXPECT_EQ(read.grid()->getSizeX(), map.grid()->getSizeX()) << origin;
		EXPECT_EQ(read.grid()->getRawMap(), map.grid()->getRawMap()) << origin;
	}
}

TEST(CSignatureMap2D, RefusesAnArchiveThatDoesNotFitItsFingerprint)
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

std::string write_file(const std::string& name, const std::vector<std::uint8_t>& bytes)
{
	std::string file = testing::TempDir() + name;
	std::ofstream(file, std::ios::binary)
	    .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
	return file;
}

TEST(CSignatureMap2D, IsAMapFile)
{
	const auto map = make_signature_map();
	const auto loaded = d2s1r::load_map(write_file("d2s1r_saved.signaturemap", serialized(map)));
	EXPECT_EQ(loaded->getRawMap(), map.grid()->getRawMap());
}

/// Expects that a map file of these bytes is refused for that reason, in one line.
void expect_refused_map_file(const std::vector<std::uint8_t>& bytes, const std::string& reason)
{
	const std::string file = write_file("d2s1r_damaged.signaturemap", bytes);
	const std::string message = d2s1r::test::message_of<std::runtime_error>([&] { d2s1r::load_map(file); });
	EXPECT_EQ(message.rfind(file + ": ", 0), 0U) << message;
	EXPECT_NE(message.find(reason), std::string::npos) << message;
	EXPECT_EQ(message.find('\n'), std::string::npos) << message;
}

TEST(CSignatureMap2D, ADamagedMapFileIsRefusedAloud)
{
	auto bytes = serialized(make_signature_map());
	auto& cell = bytes[bytes.size() - kGrid.cells.size() / 2];
	cell = static_cast<std::uint8_t>(cell + 1);
	expect_refused_map_file(bytes, "fingerprint");
	bytes.resize(bytes.size() / 2);
	expect_refused_map_file(bytes, "truncated");
}

TEST(CSignatureMap2D, AMapFileWithOtherParametersSaysWhichOneItIs)
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
	expect_refused_map_file(with("=  0.100000", "= -0.100000"), "sigma");
}

TEST(CSignatureMap2D, FingerprintTellsGridsAndParametersApart)
{
	const auto map = make_signature_map();
	EXPECT_EQ(map.fingerprint(), make_signature_map().fingerprint());
	d2s1r::Parameters parameters;
	parameters.paper.bins = 40;
	EXPECT_NE(CSignatureMap2D(*map.grid(), parameters).fingerprint(), map.fingerprint());
	auto changed = *map.grid();
	changed.setCell(12, 12, 0.01F);
	EXPECT_NE(CSignatureMap2D(changed).fingerprint(), map.fingerprint());
	const auto shifted = d2s1r::test::make_map({"#.", ".."}, 0.1, 1, 0);
	EXPECT_NE(
	    CSignatureMap2D(*shifted).fingerprint(),
	    CSignatureMap2D(*d2s1r::test::make_map({"#.", ".."}, 0.1)).fingerprint());
}

TEST(CSignatureMap2D, IsMadeFromAnIniSection)
{
	const auto maps = from_ini(
	    "[Maps]\nsignatureMap_count=1\n"
	    "[Maps_signatureMap_00_creationOpts]\nenableObservationInsertion=false\n"
	    "[Maps_signatureMap_00_insertOpts]\nmaxDistanceInsertion=7\n"
	    "[Maps_signatureMap_00_likelihoodOpts]\nsigma=0.3\n");
	const auto map = maps.mapByClass<CSignatureMap2D>();
	ASSERT_TRUE(map);
	EXPECT_TRUE(map->isEmpty());
	EXPECT_FALSE(map->genericMapParams.enableObservationInsertion);
	EXPECT_EQ(map->insertionOptions.maxDistanceInsertion, 7.0F);
	EXPECT_EQ(map->likelihood_options().sigma, 0.3);
}

TEST(CSignatureMap2D, SaysWhichIniValueIsOutOfRange)
{
	try
	{
		from_ini("[Maps]\nsignatureMap_count=1\n[Maps_signatureMap_00_likelihoodOpts]\nsigma=-1\n");
		FAIL() << "a negative sigma was accepted";
	}
	catch (const std::exception& error)
	{
		EXPECT_NE(std::string(error.what()).find("Maps_signatureMap_00_likelihoodOpts: sigma is"), std::string::npos)
		    << error.what();
	}
}

TEST(CSignatureMap2D, IsFilledFromASimpleMapAndCleared)
{
	mrpt::maps::CSimpleMap simple_map;
	for (const double x : {1.3, 2.3, 5.3})
	{
		const mrpt::math::TPose2D pose = {x, 0.9, 0};
		mrpt::obs::CSensoryFrame frame;
		frame.insert(mrpt::obs::CObservation2DRangeScan::Create(d2s1r::test::make_observation(kGrid, pose)));
		const mrpt::poses::CPose3DPDFGaussian where{mrpt::poses::CPose3D(pose)};
		simple_map.insert(where, frame);
	}
	CSignatureMap2D map;
	map.loadFromSimpleMap(simple_map);
	ASSERT_FALSE(map.isEmpty());
	EXPECT_LT(std::min(map.grid()->getPos(0.48F, 0.9F), map.grid()->getPos(0.52F, 0.9F)), 0.5F);  // P(free) of a wall
	EXPECT_GT(map.grid()->getPos(1.8F, 0.9F), 0.5F);
	const auto scan = d2s1r::test::make_observation(kGrid, kTruth);
	EXPECT_GT(
	    map.computeObservationLikelihood(scan, CPose3D(kTruth)),
	    map.computeObservationLikelihood(scan, CPose3D(kTruth) + CPose3D(1, 0.5, 0, 0, 0, 0)) + 1);
	map.clear();
	EXPECT_TRUE(map.isEmpty());
}

TEST(CSignatureMap2D, InsertingIntoACopyLeavesTheOriginalAlone)
{
	const auto original = make_signature_map();
	const auto before = original.fingerprint();
	CSignatureMap2D copy = original;
	copy.insertObservation(d2s1r::test::make_observation(kGrid, kTruth), CPose3D(kTruth) + CPose3D(0.3, 0, 0, 0, 0, 0));
	EXPECT_EQ(original.fingerprint(), before);
	EXPECT_NE(copy.fingerprint(), before);
}

TEST(CSignatureMap2D, ShowsItsGridAndNamesItself)
{
	const auto map = make_signature_map();
	mrpt::opengl::CSetOfObjects scene;
	map.getVisualizationInto(scene);
	EXPECT_FALSE(scene.empty());
	EXPECT_NE(map.asString().find("70 x 35 cells"), std::string::npos) << map.asString();
	EXPECT_NE(CSignatureMap2D().asString().find("empty"), std::string::npos);
}

TEST(CSignatureMap2D, AnEmptyMapHasNoLocalizer)
{
	EXPECT_THROW(CSignatureMap2D().localizer(), std::invalid_argument);
}
}  // namespace
