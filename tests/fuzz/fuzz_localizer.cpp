// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Random maps, parameters, scans, priors, windows and fusion steps: a scan never throws, and every answer is finite,
// has probabilities that sum to 1 at most, covariances that are positive definite, and is the same when asked for
// twice.
#include <d2s1r/parameter_list.h>
#include <d2s1r/seeding.h>
#include <d2s1r/window_localizer.h>

#include <optional>
#include <stdexcept>
#include <vector>

#include "CParticleFilterFusion.h"
#include "fuzz_input.h"

namespace
{
using namespace d2s1r;
using fuzz::Numbers;
using fuzz::require;

/// A room with some rectangles of each class in it.
OccupancyMap random_map(Numbers& numbers)
{
	constexpr double kSizes[] = {0.05, 0.05, 0.02, 0.1, 0.25, 0.0063, 1.0};  // [m] of a cell
	const int width = numbers.whole(1, 60), height = numbers.whole(1, 40);
	const double cell_size = kSizes[numbers.byte() % std::size(kSizes)];
	auto map = unknown_map(width, height, cell_size, numbers.between(-50, 50), numbers.between(-50, 50));
	const auto fill = [&](int x0, int y0, int x1, int y1, float p_free)
	{
		for (int y = std::max(0, y0); y < std::min(height, y1); y++)
			for (int x = std::max(0, x0); x < std::min(width, x1); x++) map.row(y)[x] = OccupancyMap::cell_of(p_free);
	};
	fill(0, 0, width, height, 0.0F);
	fill(1, 1, width - 1, height - 1, 1.0F);
	for (int i = numbers.byte() % 12; i > 0; i--)
	{
		constexpr float kClasses[] = {0.0F, 1.0F, 0.5F};
		const int x = numbers.whole(0, width), y = numbers.whole(0, height);
		fill(x, y, x + numbers.byte() % 20, y + numbers.byte() % 20, kClasses[numbers.byte() % 3]);
	}
	return map;
}

/// A few parameters anywhere in their ranges, but for those that make a search long.
Parameters random_parameters(Numbers& numbers)
{
	Parameters parameters;
	const auto set_one = [&](int which)
	{
		int i = 0;
		visit_parameters(
		    parameters,
		    [&](const char*, const std::string& key, auto& value, auto least, auto greatest, const char*)
		    {
			    if (i++ != which || key.rfind("max_", 0) == 0 || key == "candidates") return;
			    using Value = std::decay_t<decltype(value)>;
			    value = static_cast<Value>(numbers.between(static_cast<double>(least), static_cast<double>(greatest)));
		    });
	};
	for (int i = numbers.byte() % 4; i > 0; i--) set_one(numbers.byte() % 90);
	parameters.grid.free_threshold = std::min(parameters.grid.free_threshold, parameters.grid.occupied_threshold);
	parameters.coarse_search.spacing = std::max(parameters.coarse_search.spacing, 0.05);
	if (numbers.byte() % 8 == 0) parameters.method = Method::kPaper;
	return parameters;
}

mrpt::obs::CObservation2DRangeScan random_observation(Numbers& numbers)
{
	mrpt::obs::CObservation2DRangeScan scan;
	scan.aperture = static_cast<float>(numbers.odd(0, 7));
	scan.maxRange = static_cast<float>(numbers.odd(0, 80));
	scan.rightToLeft = numbers.flip();
	scan.sensorPose = mrpt::poses::CPose3D(
	    numbers.odd(-1, 1), numbers.odd(-1, 1), 0, numbers.odd(-4, 4), 0, numbers.byte() % 8 == 0 ? M_PI : 0);
	const auto beams = static_cast<std::size_t>(numbers.whole(0, 400));
	scan.resizeScan(beams);
	double range = numbers.between(0.1, 5);
	for (std::size_t i = 0; i < beams; i++)
	{
		const unsigned kind = numbers.byte();
		if (kind < 32) range = numbers.between(0, 10);
		scan.setScanRange(i, static_cast<float>(kind > 250 ? numbers.odd(0, 10) : range));
		scan.setScanRangeValidity(i, kind % 16 != 1);
	}
	return scan;
}

Scan random_scan(Numbers& numbers)
{
	Scan scan;
	scan.field_of_view = numbers.odd(0, 2 * M_PI);
	scan.sensor_on_robot = {numbers.odd(-1, 1), numbers.odd(-1, 1), numbers.odd(-4, 4)};
	double angle = numbers.odd(-3.2, -3);
	for (int i = numbers.whole(0, 200); i > 0; i--)
	{
		angle += numbers.odd(-0.001, 0.05);
		scan.beams.push_back({static_cast<float>(angle), static_cast<float>(numbers.odd(-0.1, 20)), numbers.flip()});
	}
	return scan;
}

Prior random_prior(Numbers& numbers)
{
	Prior prior;
	for (int i = numbers.byte() % 8; i > 4; i--)
		prior.boxes.push_back(
		    {numbers.odd(-60, 60), numbers.odd(-60, 60), numbers.odd(-60, 60), numbers.odd(-60, 60), numbers.odd(-7, 7),
		     numbers.odd(0, 4)});
	return prior;
}

void require_positive_definite(const mrpt::math::CMatrixDouble33& m)
{
	const double second = m(0, 0) * m(1, 1) - m(0, 1) * m(1, 0);
	const double third = m(0, 0) * (m(1, 1) * m(2, 2) - m(1, 2) * m(2, 1)) -
	                     m(0, 1) * (m(1, 0) * m(2, 2) - m(1, 2) * m(2, 0)) +
	                     m(0, 2) * (m(1, 0) * m(2, 1) - m(1, 1) * m(2, 0));
	require(m(0, 0) > 0 && second > 0 && third > 0 && std::isfinite(third), "a covariance that is positive definite");
}

void require_sound(const Localization& result)
{
	double sum = 0, before = 1;
	for (const Hypothesis& hypothesis : result.hypotheses)
	{
		require(std::isfinite(hypothesis.pose.x() + hypothesis.pose.y() + hypothesis.pose.phi()), "a finite pose");
		require(hypothesis.probability >= 0 && hypothesis.probability <= before, "probabilities that decrease");
		require_positive_definite(hypothesis.covariance);
		before = hypothesis.probability;
		sum += hypothesis.probability;
	}
	require(sum <= 1 + 1e-9, "probabilities that sum to 1 at most");
	require(result.confidence >= 0 && result.confidence <= 1 + 1e-9, "a confidence");
	const bool has_pose = result.status == Status::kLocalized || result.status == Status::kAmbiguous;
	require(has_pose == !result.hypotheses.empty() && has_pose == result.note.empty(), "a pose, or why there is none");
	require(result.as_sog().size() == result.hypotheses.size(), "as many modes as hypotheses");
}

void require_same(const Localization& a, const Localization& b)
{
	require(a.status == b.status && a.confidence == b.confidence && a.note == b.note, "the same status twice");
	require(a.hypotheses.size() == b.hypotheses.size(), "as many hypotheses twice");
	for (std::size_t i = 0; i < a.hypotheses.size(); i++)
		require(
		    a.hypotheses[i].pose == b.hypotheses[i].pose && a.hypotheses[i].probability == b.hypotheses[i].probability,
		    "the same hypotheses twice");
}

const Scan& to_query(const Scan& scan)
{
	return scan;
}

RangeScan to_query(const mrpt::obs::CObservation2DRangeScan& observation)
{
	return scan_of(observation);
}

void ask(const Localizer& localizer, Numbers& numbers)
{
	const Query query{random_prior(numbers), numbers.byte() % 8 == 0 ? numbers.odd(0, 5) : 0.0};
	const auto localize = [&](const auto& scan) -> std::optional<Localization>
	{
		try
		{
			return localizer.localize(to_query(scan), query);
		}
		catch (const std::invalid_argument&)
		{
			const bool is_paper = localizer.parameters().method == Method::kPaper;
			require(!(query.time_budget >= 0) || (is_paper && !query.prior.anywhere()), "no exception for a scan");
			return std::nullopt;
		}
	};
	const auto ask_twice = [&](const auto& scan)
	{
		const auto result = localize(scan);
		if (!result) return;
		require_sound(*result);
		if (query.time_budget == 0) require_same(*result, *localize(scan));
		for (const Hypothesis& hypothesis : result->hypotheses)
			require(query.prior.allows(hypothesis.pose.asTPose()), "poses that the prior allows");
	};
	ask_twice(random_observation(numbers));
	const Scan scan = random_scan(numbers);
	ask_twice(scan);
	const mrpt::poses::CPose2D anywhere(numbers.odd(-60, 60), numbers.odd(-60, 60), numbers.odd(-4, 4));
	if (const auto entropy = scan.valid() ? localizer.relative_entropy(scan, anywhere) : std::nullopt)
		require(std::isfinite(*entropy), "a relative entropy");
	if (localizer.parameters().method == Method::kPaper) return;
	if (const auto near = localizer.hypothesis_near(scan, anywhere)) require_positive_definite(near->covariance);
}

std::optional<mrpt::poses::CPose2D> random_motion(Numbers& numbers)
{
	if (numbers.byte() % 4 == 0) return std::nullopt;
	return mrpt::poses::CPose2D(numbers.odd(-1, 1), numbers.odd(-1, 1), numbers.odd(-1, 1));
}

/// Drives through scans of one map with a window and with the particle filter.
void drive(const CSignatureMap2D::Ptr& map, Numbers& numbers)
{
	const Localizer& localizer = map->localizer();
	WindowLocalizer window(localizer, numbers.whole(1, 5), random_prior(numbers));
	CParticleFilterFusion filter;
	FusionParameters parameters;
	parameters.motion = MotionSource(numbers.byte() % 3);
	parameters.filter.particles = numbers.whole(1, 60);
	parameters.seed = numbers.byte();
	filter.start({{map, random_prior(numbers)}}, parameters);
	const auto odd = random_observation(numbers);
	for (int frame = 0; frame < 4; frame++)
	{
		const auto scan = numbers.flip() ? random_observation(numbers) : odd;
		const auto motion = random_motion(numbers);
		const Localization result = localizer.localize(scan_of(scan));
		require_sound(window.add(make_scan(scan_of(scan), localizer.parameters().scan), result, motion));
		const auto pose = filter.step({scan, result, motion});
		if (!pose) continue;
		require(std::isfinite(pose->pose.x + pose->pose.y + pose->pose.phi), "a finite fused pose");
		require(pose->probability >= 0 && pose->probability <= 1 + 1e-9 && pose->particles > 0, "a fused probability");
		for (int i = 0; i < 3; i++) require(pose->covariance(i, i) >= 0, "a fused covariance");
	}
}
}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
	Numbers numbers(data, size);
	const auto grid = random_map(numbers);
	CSignatureMap2D::Ptr map;
	try
	{
		map = CSignatureMap2D::Create(grid, random_parameters(numbers));
		map->localizer();
	}
	catch (const std::invalid_argument& error)
	{
		fuzz::require_one_line(error.what());  // no free cell, or parameters that the map is too small or large for
		return 0;
	}
	ask(map->localizer(), numbers);
	if (!numbers.empty() && map->parameters().method == Method::kDefault) drive(map, numbers);
	return 0;
}
