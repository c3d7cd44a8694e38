// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "fine/scoring.h"

#include <mrpt/core/bits_math.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <vector>

#include "fine/end_point_sums.h"
#include "fine/piece_shifts.h"

namespace d2s1r
{
namespace
{
constexpr double kModelBeam = mrpt::DEG2RAD(1.0);  //!< [rad]
constexpr double kMostPassed = 3;                  //!< [-] walls and [m] of unknown space that count
constexpr double kLeastOfSegment = 3;              //!< [-] explained returns, as beams of the model; two beams at least
constexpr double kBeamsOfPiece = 8;                //!< [-] of 1 deg: so many say each something new of a piece
constexpr float kWholeCell = 0.99F;                //!< [-] of walls: passes of corners alone are no wall; rounding

enum class End
{
	kWall,
	kBesideWall,
	kOffWall,
	kUnknown
};

struct BeamEnd
{
	double log_likelihood;  //!< [nat]
	End end;
};

BeamEnd classify_end(float distance, Cell cell, const BeamModel& model)
{
	constexpr float kOnWall = 0.06F, kNearWall = 0.10F, kBesideWall = 0.20F;  // [m] as BeamModel says
	static_assert(
	    kBesideWall < static_cast<float>(kLeastCellSize) * (DistanceField::kReachCells - 0.01F), "else nothing is off");
	if (distance < kOnWall) return {model.on_wall, End::kWall};
	if (distance < kNearWall) return {0, End::kWall};
	if (cell == Cell::kUnknown) return {0, End::kUnknown};
	return {model.off_wall, distance < kBesideWall ? End::kBesideWall : End::kOffWall};
}

/// Returns how much each beam of a piece of surface counts [0, 1]. They are off together, so that a large piece counts
/// by the square root of its beams.
/// \param beams [-] of 1 deg
double share_of_beam(double beams)
{
	return std::sqrt(kBeamsOfPiece / std::max(beams, kBeamsOfPiece));
}

/// What a beam adds to the likelihood [nat].
struct BeamTerms
{
	double end;    //!< of where it ends, with what its range adds
	double other;  //!< of what it passed, and of what counts but once
};

/// Sums up what the pieces of surface that a scan shows lose [nat] against pieces whose returns all lie on walls.
class PieceSum
{
   public:
	/// \param model_beams [-] beams of the model, of 1 deg, that one beam stands for
	PieceSum(const BeamModel& model, double model_beams) : model_(model), model_beams_(model_beams) {}

	/// Adds a beam to the piece at hand.
	void add(const BeamTerms& terms, float log_range)
	{
		const double most = model_.on_wall + model_.log_range * static_cast<double>(log_range);
		ends_ += model_beams_ * (most - terms.end);
		others_ -= terms.other;
		beams_++;
	}

	/// Ends the piece at hand.
	/// \param by_shift returns what it costs [nat] that the piece stands off the map, by what its ends cost at most
	template <class ByShift>
	void end_piece(const ByShift& by_shift)
	{
		const double share = share_of_beam(model_beams_ * beams_);
		const double of_ends = share * ends_;
		loss_ += std::max(0.0, share * others_ + std::min(of_ends, by_shift(of_ends)));
		ends_ = others_ = beams_ = 0;
	}

	double log_likelihood() const { return -loss_; }  //!< [nat] of the pieces that have ended, 0 at most

   private:
	const BeamModel& model_;
	double model_beams_;
	double ends_ = 0, others_ = 0;  //!< [nat] lost by the piece at hand
	double beams_ = 0;              //!< [-] of it
	double loss_ = 0;               //!< [nat] of all others
};

/// Calls `of_piece` with the first return and the one after the last return of each piece.
template <class OfPiece>
void for_each_piece(const BeamSubset& beams, const OfPiece& of_piece)
{
	const std::size_t count = beams.log_range.size();
	for (std::size_t first = 0, past; first < count; first = past)
	{
		past = first + 1;
		while (past < count && beams.starts_segment[past] == 0) past++;
		of_piece(first, past);
	}
}

/// Sums up the score of one scan, beam by beam.
class Sum
{
   public:
	Sum(const BeamModel& model, double model_beams)
	    : model_(model),
	      model_beams_(model_beams),
	      least_of_segment_(std::max(2L, std::lround(kLeastOfSegment / model_beams)))
	{
	}

	/// Adds a beam that passed `walls` [-] and `unknown` space [m], and ends at a distance [m] from the nearest wall.
	/// \param depth_edge whether there is one between this beam and the last one
	BeamTerms add(
	    float distance, Cell cell, float walls, float unknown, float log_range, bool depth_edge, bool starts_segment)
	{
		const BeamEnd at_end = classify_end(distance, cell, model_);
		const double unknown_metres = counted(unknown);
		const double passed = model_.through_wall * counted(walls) + model_.unknown_metre * unknown_metres;
		double end = at_end.log_likelihood;
		if (at_end.end == End::kWall) end += model_.log_range * static_cast<double>(log_range);
		log_likelihood_ += model_beams_ * (end + passed);
		const bool is_through = walls > kWholeCell, is_explained = at_end.end == End::kWall && !is_through;
		const double of_run = add_run(at_end.end == End::kOffWall && !is_through);
		const double of_edge = depth_edge && !is_explained ? -model_.depth_edge : 0;
		add_explained(is_explained, depth_edge, starts_segment);
		returns_++;
		unknown_metres_ += unknown_metres;
		return {end, model_beams_ * passed + of_run + of_edge};
	}

	/// Says that the next beam is no neighbour of the last one.
	void end_run() { was_in_front_ = false; }

	/// Returns the score of the beams that were added.
	Score result()
	{
		Score score;
		score.log_likelihood = log_likelihood_;
		score.explained = returns_ > 0 ? static_cast<double>(explained_) / returns_ : 0;
		score.returns = model_beams_ * returns_;
		score.contradicted = model_beams_ * (returns_ - explained_ - in_front_);
		score.unknown_metres = model_beams_ * unknown_metres_;
		score.segments = segments_;
		return score;
	}

   private:
	static double counted(float passed) { return std::min(static_cast<double>(passed), kMostPassed); }

	/// Charges a run of beams that end in front of walls once.
	/// \return what it charged [nat]
	double add_run(bool is_in_front)
	{
		const double charge = is_in_front && !was_in_front_ ? model_.off_wall_run : 0;
		log_likelihood_ += charge;
		was_in_front_ = is_in_front;
		in_front_ += is_in_front ? 1 : 0;
		return charge;
	}

	/// Counts what the map explains: beams, segments, and depth edges between two of these beams.
	void add_explained(bool is_explained, bool depth_edge, bool starts_segment)
	{
		if (depth_edge && is_explained && was_explained_) log_likelihood_ += model_.depth_edge;
		was_explained_ = is_explained;
		explained_ += is_explained ? 1 : 0;
		if (starts_segment) of_segment_ = 0;
		if (is_explained && ++of_segment_ == least_of_segment_) segments_++;
	}

	const BeamModel& model_;
	double model_beams_;  //!< [-] beams of the model, of 1 deg, that one beam stands for
	long least_of_segment_;
	double log_likelihood_ = 0, unknown_metres_ = 0;
	int returns_ = 0, explained_ = 0, in_front_ = 0, segments_ = 0, of_segment_ = 0;
	bool was_in_front_ = false, was_explained_ = false;
};

/// Returns the log-likelihood [nat] of beams that saw nothing. It is small, for glass and dark surfaces do not return
/// every beam.
double of_no_returns(
    const BeamTracer& tracer, const BeamSubset& beams, const mrpt::math::TPose2D& sensor, const BeamModel& model)
{
	thread_local TracedBeams traced;
	tracer.trace(beams.no_returns, sensor, traced);
	double sum = 0;
	for (std::size_t i = 0; i < beams.count - beams.log_range.size(); i++)
		if (traced.walls[i] > kWholeCell) sum += model.no_return_at_wall;
	return beams.spacing / kModelBeam * sum;
}

/// Returns the score of the beams that returned. \param take takes the terms of each
template <class Take>
Score sum_of_returns(
    const BeamTracer& tracer, const DistanceField& field, const BeamSubset& beams, const mrpt::math::TPose2D& sensor,
    const BeamModel& model, const Take& take)
{
	thread_local TracedBeams traced;
	thread_local std::vector<float> to_wall;
	tracer.trace(beams.returns, sensor, traced);
	distances_of_ends(field, beams.returns, sensor, to_wall);
	Sum sum(model, beams.spacing / kModelBeam);
	for (std::size_t i = 0; i < beams.log_range.size(); i++)
	{
		if (beams.starts_run[i] != 0) sum.end_run();
		take(sum.add(
		    to_wall[i], static_cast<Cell>(traced.end[i]), traced.walls[i], traced.unknown[i], beams.log_range[i],
		    beams.depth_edge[i] != 0, beams.starts_segment[i] != 0));
	}
	return sum.result();
}
}  // namespace

Score score(
    const BeamTracer& tracer, const DistanceField& field, const BeamSubset& beams, const mrpt::math::TPose2D& sensor,
    const BeamModel& model)
{
	Score score = sum_of_returns(tracer, field, beams, sensor, model, [](const BeamTerms&) {});
	score.log_likelihood += of_no_returns(tracer, beams, sensor, model);
	return score;
}

double log_likelihood_by_pieces(
    const BeamTracer& tracer, const DistanceField& field, const BeamSubset& beams, const mrpt::math::TPose2D& sensor,
    const BeamModel& model)
{
	thread_local std::vector<BeamTerms> terms;
	terms.clear();
	sum_of_returns(tracer, field, beams, sensor, model, [](const BeamTerms& of_beam) { terms.push_back(of_beam); });
	PieceSum pieces(model, beams.spacing / kModelBeam);
	PieceShifts shifts(field, beams.returns, sensor);
	for_each_piece(
	    beams,
	    [&](std::size_t first, std::size_t past)
	    {
		    for (std::size_t i = first; i < past; i++) pieces.add(terms[i], beams.log_range[i]);
		    pieces.end_piece([&](double most) { return shifts.cost_of(first, past, most); });
	    });
	const double others = beams.spacing / kModelBeam * static_cast<double>(beams.count - beams.log_range.size());
	const double of_others = share_of_beam(others) * of_no_returns(tracer, beams, sensor, model);  // one piece
	return pieces.log_likelihood() + of_others;
}

double greatest_log_likelihood(const BeamSubset& beams, const BeamModel& model)
{
	const auto gain = [](double weight) { return std::max(0.0, weight); };
	const double of_each = std::max(gain(model.on_wall), model.off_wall) +
	                       kMostPassed * (gain(model.through_wall) + gain(model.unknown_metre));
	double sum = static_cast<double>(beams.count - beams.log_range.size()) * gain(model.no_return_at_wall);
	double once = 0;  // [nat] what counts by runs and depth edges, however wide beams are
	for (std::size_t i = 0; i < beams.log_range.size(); i++)
	{
		sum += of_each + gain(model.log_range * static_cast<double>(beams.log_range[i]));
		once += gain(model.off_wall_run) + (beams.depth_edge[i] != 0 ? gain(model.depth_edge) : 0);
	}
	return beams.spacing / kModelBeam * sum + once;
}

Bound bound_of(
    const BeamTracer& tracer, const DistanceField& field, const BeamSubset& beams, const mrpt::math::TPose2D& sensor,
    const BeamModel& model)
{
	constexpr double kRounding = 1e-6;  // [nat]
	// As a rule nothing that a beam passes adds to its likelihood.
	const auto gain = [](double weight) { return std::max(0.0, weight); };
	const auto loss = [](double weight) { return std::min(0.0, weight); };
	const double most_by_beam = kMostPassed * (gain(model.through_wall) + gain(model.unknown_metre));
	const double model_beams = beams.spacing / kModelBeam;
	const double through = model_beams * loss(model.through_wall) * static_cast<double>(kWholeCell);
	thread_local TracedBeams ends;
	thread_local std::vector<float> to_wall;
	tracer.locate_ends(beams.returns, sensor, ends);
	distances_of_ends(field, beams.returns, sensor, to_wall);
	const auto no_returns = static_cast<double>(beams.count - beams.log_range.size());
	double sum = kRounding + model_beams * no_returns * gain(model.no_return_at_wall);
	PieceSum pieces(model, model_beams);
	double squares = 0, of_piece = 0;  // [m^2] of the distances of the piece at hand, [-] its beams
	const auto end_piece = [&]
	{
		pieces.end_piece([&](double) { return squares / of_piece / (2 * mrpt::square(kPieceShift)); });
		squares = of_piece = 0;
	};
	bool was_on_wall = false, was_off_wall = false;
	double left_of_run = 0;  // [nat] The beams of a run off the walls are charged for it, or each for a wall it passed.
	for (std::size_t i = 0; i < beams.log_range.size(); i++)
	{
		const BeamEnd at_end = classify_end(to_wall[i], static_cast<Cell>(ends.end[i]), model);
		const bool on_wall = at_end.end == End::kWall, off_wall = at_end.end == End::kOffWall;
		const float log_range = beams.log_range[i];
		const double by_range = on_wall ? model.log_range * static_cast<double>(log_range) : 0;
		sum += model_beams * (at_end.log_likelihood + by_range + most_by_beam);
		if (i > 0 && beams.starts_segment[i] != 0) end_piece();
		pieces.add({at_end.log_likelihood + by_range, 0}, log_range);
		squares += mrpt::square(std::min(kFarthestShift, static_cast<double>(to_wall[i])));
		of_piece++;
		if (beams.depth_edge[i] != 0 && on_wall && was_on_wall) sum += gain(model.depth_edge);
		if (off_wall)
		{
			if (!was_off_wall || beams.starts_run[i] != 0) left_of_run = loss(model.off_wall_run);
			const double charge = std::max(through, left_of_run);
			left_of_run -= charge;
			sum += charge + gain(model.off_wall_run);
		}
		was_on_wall = on_wall;
		was_off_wall = off_wall;
	}
	if (of_piece > 0) end_piece();
	return {sum, pieces.log_likelihood()};
}

ScoredPose best_score_near(
    const BeamTracer& tracer, const DistanceField& field, const BeamSubset& beams, const mrpt::math::TPose2D& sensor,
    const BeamModel& model)
{
	constexpr double kTurn = 0.2;  // [rad] for each metre of a step
	ScoredPose best{sensor, score(tracer, field, beams, sensor, model)};
	for (const double step : {0.04, 0.02})  // [m]
		for (const mrpt::math::TPose2D& move : std::initializer_list<mrpt::math::TPose2D>{
		         {step, 0, 0}, {-step, 0, 0}, {0, step, 0}, {0, -step, 0}, {0, 0, kTurn * step}, {0, 0, -kTurn * step}})
		{
			const mrpt::math::TPose2D pose = best.pose + move;
			if (bound_of(tracer, field, beams, pose, model).log_likelihood <= best.score.log_likelihood) continue;
			const Score found = score(tracer, field, beams, pose, model);
			if (found.log_likelihood > best.score.log_likelihood) best = {pose, found};
		}
	return best;
}
}  // namespace d2s1r
