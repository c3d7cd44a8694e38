// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Arguments and files of ten and a hundred times the size take ten and a hundred times as long (doc/promises.md lists
// the loops).
#include <d2s1r/atlas.h>
#include <d2s1r/map_io.h>
#include <d2s1r/seeding.h>
#include <mrpt/poses/CPosePDFParticles.h>
#include <mrpt/poses/CPosePDFSOG.h>

#include <random>

#include "frames/tracks.h"
#include "growth.h"
#include "made_hypotheses.h"
#include "test_files.h"
#include "test_floor.h"
#include "test_maps.h"

namespace d2s1r::test
{
namespace
{
const Localizer& on_floor()
{
	static const Localizer localizer(make_map(make_floor()));
	return localizer;
}

TEST(Growth, OfPriors)
{
	expect_linear(
	    "particles", 1000,
	    [](std::size_t n)
	    {
		    mrpt::poses::CPosePDFParticles particles(n);
		    std::mt19937 random(1);
		    std::uniform_real_distribution<double> x(-1e6, 1e6), phi(-M_PI, M_PI);
		    for (auto& particle : particles.m_particles) particle.d = {x(random), x(random), phi(random)};
		    return [particles] { EXPECT_LE(make_prior(particles).boxes.size(), 256U); };
	    });
	expect_linear(
	    "modes", 1000,
	    [](std::size_t n)
	    {
		    mrpt::poses::CPosePDFSOG sum(n);
		    for (std::size_t i = 0; i < n; i++) sum.get(i).cov = covariance_of(1, 1, 1);
		    return [sum] { make_prior(sum); };
	    });
}

TEST(Growth, OfMotionsThatAreGuessed)
{
	const auto places = [](std::size_t n)
	{
		std::vector<Hypothesis> hypotheses;
		for (std::size_t i = 0; i < n; i++)
			hypotheses.push_back(hypothesis_at({0.01 * static_cast<double>(i), 0, 0}, 1 / static_cast<double>(n)));
		return hypotheses;
	};
	expect_linear(
	    "hypotheses of a frame", 30,
	    [&](std::size_t n)
	    { return [from = places(50), to = places(n)] { common_motion(from, to, WindowTuning{}); }; });
}

TEST(Growth, OfParticles)
{
	expect_linear(
	    "hypotheses and particles", 100,
	    [](std::size_t n)
	    {
		    Localization localization = result_of({});
		    for (std::size_t i = 0; i < n; i++)
			    localization.hypotheses.push_back(
			        hypothesis_at(mrpt::poses::CPose2D(2, 2, 0), 1 / static_cast<double>(n)));
		    SeedingParameters parameters;
		    parameters.particles = static_cast<int>(2 * n);
		    return [localization, parameters] { seed_particles(on_floor(), localization, parameters); };
	    });
}

TEST(Growth, OfScans)
{
	const Grid world = world_of(make_floor());
	expect_linear(
	    "beams", 50,
	    [&](std::size_t n)
	    {
		    auto scan = make_observation(world, {-1, 6, 0.3});
		    const auto few = scan;
		    scan.ranges.resize(n);
		    for (std::size_t i = 0; i < n; i++) scan.ranges[i] = few.ranges[i * few.size() / n];
		    scan.valid.clear();  // all are
		    return [scan] { on_floor().localize(scan); };
	    });
	auto endless = make_observation(world, {-1, 6, 0.3});
	endless.ranges.assign(200'000, 1.0F);
	endless.valid.clear();
	const Localization result = on_floor().localize(endless);
	EXPECT_EQ(result.status, Status::kInvalid);
	EXPECT_NE(result.note.find("beams"), std::string::npos) << result.note;
}

TEST(Growth, OfYamlFiles)
{
	const TempFolder folder;
	expect_linear(
	    "keys", 150,
	    [&](std::size_t n)
	    {
		    std::string text = "maps: {}\n";
		    for (std::size_t i = 0; i < n; i++) text += "key" + std::to_string(i) + ": 1\n";
		    return [file = folder.write("atlas.yaml", text)] { EXPECT_TRUE(is_atlas(file)); };
	    });
	expect_linear(
	    "maps", 20,
	    [&](std::size_t n)
	    {
		    std::string text = "maps:\n";
		    for (std::size_t i = 0; i < n; i++) text += "  map" + std::to_string(i) + ": {file: a.yaml, floor: '1'}\n";
		    return [file = folder.write("atlas.yaml", text), n] { EXPECT_EQ(read_atlas(file).size(), n); };
	    });
}
}  // namespace
}  // namespace d2s1r::test
