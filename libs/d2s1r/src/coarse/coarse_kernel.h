// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "coarse/range_profiles.h"

namespace d2s1r
{
/// A beam of the overview search.
struct OverviewBeam
{
	int direction;                 //!< [-] of the profiles, before a shift
	std::uint8_t least, greatest;  //!< [2 steps] ranges of the overview that agree with it
};

/// The few beams of a scan that overviews are compared with.
struct OverviewScan
{
	const OverviewBeam* beams;
	std::size_t count;        //!< [-] beams
	int directions;           //!< [-] of the profiles, and shifts
	std::uint8_t truncation;  //!< [2 steps] count * truncation must fit a byte
};

/// A row at a yaw shift that costs little.
struct CheapPair
{
	std::uint16_t row, shift;  //!< [-]
	std::uint8_t cost;         //!< [2 steps] lower is better
};

/// Predicts a range of a sample position from the overview of its group.
struct Prediction
{
	int turn;  //!< [directions] from the one that is predicted to the one of the overview that is taken
	int more;  //!< [step] added to its range
};

/// The predictions that a profile has the choice of; those with the same turn follow one another. They were chosen for
/// the least truncated error in maps of intel, fr_campus and mit_killian and on a generated floor: depth edges of a
/// room are seen some directions further from 0.14 m beside.
inline constexpr std::array<Prediction, 16> kPredictions{
    {{0, -9},
     {0, -3},
     {0, -1},
     {0, 0},
     {0, 1},
     {0, 2},
     {0, 4},
     {0, 9},
     {-1, -2},
     {-1, 3},
     {1, -2},
     {1, 3},
     {-2, 1},
     {2, 1},
     {-4, 1},
     {4, 1}}};
inline constexpr std::size_t kMostTurn = 4;  //!< [directions] of a prediction
static_assert(
    []
    {
	    constexpr int kMost = static_cast<int>(kMostTurn);
	    for (const Prediction& prediction : kPredictions)
		    if (prediction.turn < -kMost || prediction.turn > kMost) return false;
	    return true;
    }());

/// Returns the distance [byte] between rows of so many directions, so that kernels may read and write whole vectors.
constexpr std::size_t row_stride(std::size_t directions)
{
	return in_whole_lines(directions + RangeProfiles::kBlock);
}

/// Computes the ranges [step] of `count` positions of a group, which follow one another, from their predictions.
/// \param around [step] ranges of the group's overview in all directions; kMostTurn before them are the last ones
///        again, kMostTurn behind them the first ones, and RangeProfiles::kBlock bytes follow that may be read
/// \param numbers of kPredictions, as in RangeProfiles::predictions
/// \param rows room for them, row_stride() apart
void predicted_rows(
    const std::uint8_t* around, const std::uint8_t* numbers, std::size_t count, std::size_t directions,
    std::uint8_t* rows);

/// Counts, for each group of a block, the beams that are missing there [1 / RangeProfiles::kWhole]: the sum over the
/// bins of what `histogram` has more than that of the group.
/// \param block range histograms (bin, group)
void missing_beams(const std::uint8_t* block, const std::uint8_t* histogram, std::uint8_t* missing);

/// Returns a bit for each group of a block where `least` to `most` beams are missing.
std::uint64_t groups_between(const std::uint8_t* missing, int least, int most);

/// Finds all pairs of row and shift that cost at most `most`. The cost is the sum over beams of the truncated
/// distance of row[direction + shift] from least ... greatest. It only grows with the beams, so that as a rule some of
/// them suffice to tell that it will be above.
/// \param rows each of which holds the directions twice, and RangeProfiles::kBlock bytes of any value
/// \param found room for all pairs
/// \return their number
std::size_t find_cheap_pairs(
    const std::uint8_t* rows, std::size_t count, const OverviewScan& scan, std::uint8_t most, CheapPair* found);

/// A scan at a yaw shift, with which rows are compared direction by direction.
struct ScanRow
{
	const std::uint8_t *least, *greatest;   //!< [step] ranges between which a row agrees with the scan
	const std::uint8_t* truncation;         //!< [step] greatest difference that counts; 0 where there is no beam
	const std::uint8_t* truncation_beyond;  //!< [step] that of rows whose range is the greater one
	std::size_t length;                     //!< [-] directions; RangeProfiles::kBlock more may be read
};

/// Computes the costs of `count` rows, which are row_stride() apart: the sums over directions of the truncated distance
/// of row[i] from least[i] ... greatest[i].
void row_costs(const std::uint8_t* rows, std::size_t count, const ScanRow& scan, std::uint32_t* costs);
}  // namespace d2s1r
