// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include <d2s1r/CSignatureMap2D.h>
#include <gtest/gtest.h>
#include <mrpt/config/CConfigFileMemory.h>
#include <mrpt/maps/CMultiMetricMap.h>
#include <mrpt/maps/CSimpleMap.h>
#include <mrpt/maps/CSimplePointsMap.h>
#include D2S1R_DRAWING(CSetOfObjects.h)
#include <mrpt/poses/CPose3DPDFGaussian.h>

#include "signature_map_room.h"
#include "test_files.h"

using d2s1r::CSignatureMap2D;
using d2s1r::test::kGrid;
using d2s1r::test::kTruth;
using d2s1r::test::make_signature_map;
using mrpt::poses::CPose3D;

namespace
{
mrpt::maps::CMultiMetricMap from_ini(const std::string& ini)
{
	mrpt::maps::TSetOfMetricMapInitializers definition;
	definition.loadFromConfigFile(mrpt::config::CConfigFileMemory(ini), "Maps");
	mrpt::maps::CMultiMetricMap maps;
	maps.setListOfMaps(definition);
	return maps;
}

TEST(CSignatureMap2D, InsertionFollowsItsOptions)
{
	const auto scan = d2s1r::test::make_mrpt_observation(kGrid, kTruth);
	const auto known = [&](float reach)
	{
		CSignatureMap2D map;
		map.insertionOptions.maxDistanceInsertion = reach;
		map.insertObservation(scan, CPose3D(kTruth));
		const auto& cells = map.grid()->getRawMap();
		return std::count_if(cells.begin(), cells.end(), [](auto cell) { return cell != 0; });
	};
	EXPECT_LT(2 * known(0.8F), known(20));
}

TEST(CSignatureMap2D, IsNotShownIfItIsNotToBeSaved)
{
	auto map = make_signature_map();
	map.genericMapParams.enableSaveAs3DObject = false;
	d2s1r::drawing::CSetOfObjects scene;
	map.getVisualizationInto(scene);
	EXPECT_TRUE(scene.empty());
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
	const auto shifted = d2s1r::test::make_mrpt_map({"#.", ".."}, 0.1, 1, 0);
	EXPECT_NE(
	    CSignatureMap2D(*shifted).fingerprint(),
	    CSignatureMap2D(*d2s1r::test::make_mrpt_map({"#.", ".."}, 0.1)).fingerprint());
	const auto higher = d2s1r::test::make_mrpt_map({"#.", ".."}, 0.1, 0, 1);
	EXPECT_NE(
	    CSignatureMap2D(*higher).fingerprint(),
	    CSignatureMap2D(*d2s1r::test::make_mrpt_map({"#.", ".."}, 0.1)).fingerprint());
}

TEST(CSignatureMap2D, IsMadeFromAnIniSection)
{
	const auto maps = from_ini(
	    "[Maps]\nsignatureMap_count=1\n"
	    "[Maps_signatureMap_00_creationOpts]\nenableObservationInsertion=false\n"
	    "[Maps_signatureMap_00_insertOpts]\nmaxDistanceInsertion=7\n"
	    "[Maps_signatureMap_00_likelihoodOpts]\nsigma=0.3 ; [m]\nbeams = 45 // at most\n");
	const auto map = maps.mapByClass<CSignatureMap2D>();
	ASSERT_TRUE(map);
	EXPECT_TRUE(map->isEmpty());
	EXPECT_FALSE(map->genericMapParams.enableObservationInsertion);
	EXPECT_EQ(map->insertionOptions.maxDistanceInsertion, 7.0F);
	EXPECT_EQ(map->likelihood_options().sigma, 0.3);
	EXPECT_EQ(map->likelihood_options().beams, 45);
}

TEST(CSignatureMap2D, ReadsItsMapWithTheParametersOfItsConfiguration)
{
	const d2s1r::test::TempFolder folder;
	const std::string image = folder.write("grey.pgm", std::string("P5\n2 1\n255\n\x8C\x00", 13));  // P(occupied) 0.45
	const std::string yaml = folder.write(
	    "grey.yaml",
	    "image: grey.pgm\nresolution: 0.1\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.9\n"
	    "free_thresh: 0\nmode: scale\n");
	const std::string config = folder.write("grey.ini", "[grid]\nfree_threshold = 0.55\n");
	const std::string definition =
	    "[Maps]\nsignatureMap_count=1\n[Maps_signatureMap_00_creationOpts]\nmap_file=" + yaml + "\n";
	EXPECT_THROW(from_ini(definition), std::exception) << "nothing is free by the default thresholds";
	EXPECT_NO_THROW(from_ini(definition + "config_file=" + config + "\n"));
}

TEST(CSignatureMap2D, SaysWhichIniValueIsNotUsable)
{
	const std::map<std::string, std::string> lines{
	    {"sigma=-1", "sigma = '-1'"},    {"sigma=wide", "sigma = 'wide'"},       {"beams=90.7", "beams = '90.7'"},
	    {"beams=1", "beams = '1'"},      {"beams=1e99", "beams = '1e99'"},       {"sigmo=0.1", "sigmo is not"},
	    {"random_share=", "share = ''"}, {"unknown_share=nan", "share = 'nan'"},
	};
	for (const auto& [line, reason] : lines) try
		{
			from_ini("[Maps]\nsignatureMap_count=1\n[Maps_signatureMap_00_likelihoodOpts]\n" + line + "\n");
			ADD_FAILURE() << line << " was accepted";
		}
		catch (const std::exception& error)
		{
			const std::string message = error.what();
			EXPECT_NE(message.find("Maps_signatureMap_00_likelihoodOpts: "), std::string::npos) << message;
			EXPECT_NE(message.find(reason), std::string::npos) << message;
		}
}

TEST(CSignatureMap2D, StaysUsableWhenItsContentIsMovedOn)
{
	CSignatureMap2D map = make_signature_map();
	const CSignatureMap2D other = std::move(map);  // NOLINT(performance-move-const-arg): copies
	EXPECT_FALSE(other.isEmpty());
	EXPECT_EQ(map.fingerprint(), other.fingerprint());  // NOLINT(bugprone-use-after-move): that is the point
}

TEST(CSignatureMap2D, RefusesCreationOptionsThatItDoesNotKnow)
{
	try
	{
		from_ini("[Maps]\nsignatureMap_count=1\n[Maps_signatureMap_00_creationOpts]\nmapfile=building.yaml\n");
		FAIL() << "the map would be empty";
	}
	catch (const std::exception& error)
	{
		const std::string message = error.what();
		EXPECT_NE(message.find("Maps_signatureMap_00_creationOpts: mapfile is not a parameter"), std::string::npos)
		    << message;
	}
}

/// `signatureMap_count` may be greater than the number of sections: such a map would never get a cell.
TEST(CSignatureMap2D, RefusesADefinitionWithoutAnySection)
{
	const char* const one = "[Maps]\nsignatureMap_count=1\n[Maps_signatureMap_00_insertOpts]\nmaxDistanceInsertion=9\n";
	EXPECT_TRUE(from_ini(one).mapByClass<CSignatureMap2D>()->isEmpty()) << "scans may be inserted";
	try
	{
		from_ini("[Maps]\nsignatureMap_count=2\n[Maps_signatureMap_00_creationOpts]\n");
		FAIL();
	}
	catch (const std::exception& error)
	{
		EXPECT_NE(
		    std::string(error.what()).find("section Maps_signatureMap_01_creationOpts is missing"), std::string::npos)
		    << error.what();
	}
}

TEST(CSignatureMap2D, IsFilledFromASimpleMapAndCleared)
{
	mrpt::maps::CSimpleMap simple_map;
	for (const double x : {1.3, 2.3, 5.3})
	{
		const mrpt::math::TPose2D pose = {x, 0.9, 0};
		const auto frame = mrpt::obs::CSensoryFrame::Create();
		frame->insert(mrpt::obs::CObservation2DRangeScan::Create(d2s1r::test::make_mrpt_observation(kGrid, pose)));
		simple_map.insert(mrpt::poses::CPose3DPDFGaussian::Create(mrpt::poses::CPose3D(pose)), frame);
	}
	CSignatureMap2D map;
	map.loadFromSimpleMap(simple_map);
	ASSERT_FALSE(map.isEmpty());
	EXPECT_LT(std::min(map.grid()->getPos(0.48F, 0.9F), map.grid()->getPos(0.52F, 0.9F)), 0.5F);  // P(free) of a wall
	EXPECT_GT(map.grid()->getPos(1.8F, 0.9F), 0.5F);
	const auto scan = d2s1r::test::make_mrpt_observation(kGrid, kTruth);
	EXPECT_GT(
	    map.computeObservationLikelihood(scan, CPose3D(kTruth)),
	    map.computeObservationLikelihood(scan, CPose3D(kTruth) + CPose3D(1, 0.5, 0, 0, 0, 0)) + 1);
	map.clear();
	EXPECT_TRUE(map.isEmpty());
}

TEST(CSignatureMap2D, ScansAnywhereAreDrawnWhereTheyAreOrRefused)
{
	const auto scan = d2s1r::test::make_mrpt_observation(kGrid, kTruth);
	CSignatureMap2D map;
	map.insertObservation(scan, CPose3D(kTruth) + CPose3D(3000, -3000, 0, 0, 0, 0));
	EXPECT_LT(map.grid()->getSizeX(), 2000U);
	EXPECT_LT(map.grid()->getSizeY(), 2000U);
	map.insertObservation(scan, CPose3D(kTruth) + CPose3D(3010, -3000, 0, 0, 0, 0));
	const auto before = map.fingerprint();
	for (const double x : {0.0, 1e7, HUGE_VAL, std::nan("")})
		EXPECT_THROW(map.insertObservation(scan, CPose3D(x, 0, 0, 0, 0, 0)), std::exception) << x;
	EXPECT_THROW(CSignatureMap2D().insertObservation(scan, CPose3D(1e7, 0, 0, 0, 0, 0)), std::invalid_argument);
	EXPECT_EQ(map.fingerprint(), before) << "what was refused changes nothing";
}

TEST(CSignatureMap2D, InsertingIntoACopyLeavesTheOriginalAlone)
{
	const auto original = make_signature_map();
	const auto before = original.fingerprint();
	CSignatureMap2D copy = original;
	copy.insertObservation(
	    d2s1r::test::make_mrpt_observation(kGrid, kTruth), CPose3D(kTruth) + CPose3D(0.3, 0, 0, 0, 0, 0));
	EXPECT_EQ(original.fingerprint(), before);
	EXPECT_NE(copy.fingerprint(), before);
}

TEST(CSignatureMap2D, ShowsItsGridAndNamesItself)
{
	const auto map = make_signature_map();
	d2s1r::drawing::CSetOfObjects scene;
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
