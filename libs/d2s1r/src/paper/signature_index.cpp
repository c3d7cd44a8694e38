// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "paper/signature_index.h"

#include <Eigen/Eigenvalues>
#include <nanoflann.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <sstream>
#include <stdexcept>

#include "base/array.h"
#include "paper/signature_counts.h"

namespace d2s1r
{
namespace
{
constexpr int kProjectionSize = 8;  //!< [-] axes

/// A signature projected on the axes that carry most of the variance.
using ProjectedSignature = std::array<float, kProjectionSize>;

/// Projects signatures on the principal axes of a map's signatures. The projection is orthonormal, so that it never
/// lengthens a distance.
class SignatureProjection
{
   public:
	SignatureProjection() = default;

	/// Finds the axes. \param counts of at least one cell
	explicit SignatureProjection(const SignatureCounts& counts);

	template <class Self, class File>
	static void fields(Self& self, File& file)
	{
		file(self.axes_);
	}

	/// Returns the projection [rays] of a signature. \param counts [rays] one per bin
	template <class Count>
	ProjectedSignature project(const Count* counts) const
	{
		ProjectedSignature projected{};
		for (std::size_t bin = 0; bin < axes_.size(); bin++)
			for (std::size_t i = 0; i < projected.size(); i++)
				projected[i] += static_cast<float>(counts[bin]) * axes_[bin][i];
		return projected;
	}

   private:
	Array<ProjectedSignature> axes_;  //!< by bin
};

/// Returns the covariance of the signatures of evenly spaced cells: the axes need not be exact.
Eigen::MatrixXd covariance_of(const SignatureCounts& counts)
{
	constexpr std::size_t kCells = 20000;
	const std::size_t cells = counts.counts.size() / static_cast<std::size_t>(counts.bins);
	const std::size_t step = std::max<std::size_t>(1, cells / kCells);
	Eigen::MatrixXd products = Eigen::MatrixXd::Zero(counts.bins, counts.bins);
	Eigen::VectorXd sum = Eigen::VectorXd::Zero(counts.bins);
	double n = 0;
	for (std::size_t cell = 0; cell < cells; cell += step, n++)
	{
		const Eigen::VectorXd signature =
		    Eigen::Map<const Eigen::Matrix<std::uint8_t, Eigen::Dynamic, 1>>(counts.of(cell), counts.bins)
		        .cast<double>();
		products.noalias() += signature * signature.transpose();
		sum += signature;
	}
	return products / n - sum * sum.transpose() / (n * n);
}

SignatureProjection::SignatureProjection(const SignatureCounts& counts)
{
	std::vector<ProjectedSignature> axes(static_cast<std::size_t>(counts.bins));
	const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(covariance_of(counts));  // increasing eigenvalues
	for (int i = 0; i < std::min(kProjectionSize, counts.bins); i++)
		for (int bin = 0; bin < counts.bins; bin++)
			axes[static_cast<std::size_t>(bin)][static_cast<std::size_t>(i)] =
			    static_cast<float>(solver.eigenvectors()(bin, counts.bins - 1 - i));
	axes_ = std::move(axes);
}

constexpr std::size_t kLeafSize = 64;    //!< [-] signatures of a leaf of the tree
constexpr int kFraction = 8;             //!< [-] steps to a ray in which a query is counted
constexpr float kRoundingSlack = 1e-4F;  //!< [-] by which squared distances of projections are shortened

/// The signature of a query, counted in rays as the index counts them.
struct ScaledQuery
{
	std::vector<std::int32_t> counts;  //!< [ray / kFraction] padded to the stride of the signatures
	ProjectedSignature projected{};    //!< [rays]
};

/// Keeps the k cells that are nearest by full signatures. nanoflann feeds it with those that are near enough by their
/// projections.
template <class Distance>
class NearestByFullDistance
{
   public:
	using DistanceType = float;

	NearestByFullDistance(std::size_t k, std::vector<NearestCell>& nearest, const Distance& distance)
	    : k_(k), nearest_(nearest), distance_(distance)
	{
		nearest_.clear();
	}
	std::size_t size() const { return nearest_.size(); }
	void sort() const {}  // it always is
	bool full() const { return nearest_.size() == k_; }
	/// Returns the distance up to which nanoflann offers cells. One that is as far as the last one is offered, too,
	/// because ties are resolved by cell.
	float worstDist() const
	{
		constexpr float kGreatest = std::numeric_limits<float>::max();
		return full() ? std::nextafter(nearest_.back().squared_distance, kGreatest) : kGreatest;
	}
	bool addPoint(float projected_distance, std::uint32_t point)
	{
		if (projected_distance > worstDist()) return true;
		const NearestCell found = distance_(point);
		if (full() && !is_nearer(found, nearest_.back())) return true;
		if (full()) nearest_.pop_back();
		nearest_.insert(std::upper_bound(nearest_.begin(), nearest_.end(), found, is_nearer), found);
		return true;
	}

   private:
	static bool is_nearer(const NearestCell& a, const NearestCell& b)
	{
		return std::pair(a.squared_distance, a.cell) < std::pair(b.squared_distance, b.cell);
	}
	std::size_t k_;
	std::vector<NearestCell>& nearest_;
	const Distance& distance_;
};

// nanoflann has renamed these since Debian 12.
#if NANOFLANN_VERSION >= 0x150
using SearchParameters = nanoflann::SearchParameters;
template <class KdTree>
auto& points_by_leaf(KdTree& tree)
{
	return tree.vAcc_;
}
#else
using SearchParameters = nanoflann::SearchParams;
template <class KdTree>
auto& points_by_leaf(KdTree& tree)
{
	return tree.vAcc;
}
#endif

template <class T>
std::vector<T> permuted(const std::vector<T>& values, const std::vector<std::uint32_t>& order)
{
	std::vector<T> result;
	result.reserve(values.size());
	for (const std::uint32_t from : order) result.push_back(values[from]);
	return result;
}
}  // namespace

/// A kd-tree of projections. As these never lengthen a distance, the nearest full signatures are found exactly.
struct SignatureIndex::Tree
{
	struct Metric
	{
		using ElementType = float;
		using DistanceType = float;
		const Tree& tree;
		Metric(const Tree& tree_) : tree(tree_) {}
		float evalMetric(const float* query, std::uint32_t point, std::size_t) const
		{
			using Vector = Eigen::Map<const Eigen::Matrix<float, kProjectionSize, 1>>;
			return (Vector(query) - Vector(tree.projections[point].data())).squaredNorm() * (1 - kRoundingSlack);
		}
		template <class A, class B>
		float accum_dist(A a, B b, std::size_t) const
		{
			return (a - b) * (a - b);
		}
	};
	using KdTree = nanoflann::KDTreeSingleIndexAdaptor<Metric, Tree, kProjectionSize, std::uint32_t>;

	std::size_t bins = 0;
	float directions = 0;    //!< [rays] of a signature
	std::size_t stride = 0;  //!< [byte] between signatures
	SignatureProjection projection;
	Array<CellIndex> cells;                 //!< in the order of the tree's leaves, as all that follows
	Array<ProjectedSignature> projections;  //!< [rays]
	Array<std::uint8_t> signatures;         //!< [rays] (cell, bin)
	std::unique_ptr<KdTree> kd_tree;

	Tree(const std::vector<CellIndex>& cells_, const SignatureCounts& counts);
	explicit Tree(IndexReader& file);
	void save(IndexWriter& file) const;
	template <class Self, class File>
	static void fields(Self& self, File& file)
	{
		file(self.bins);
		file(self.directions);
		file(self.stride);
		SignatureProjection::fields(self.projection, file);
		file(self.cells);
		file(self.projections);
		file(self.signatures);
	}
	void fill(ScaledQuery& query, const Signature& signature) const;
	NearestCell distance(const ScaledQuery& query, std::uint32_t point) const;

	std::size_t kdtree_get_point_count() const { return projections.size(); }
	float kdtree_get_pt(std::size_t point, std::size_t axis) const { return projections[point][axis]; }
	template <class Box>
	bool kdtree_get_bbox(Box&) const
	{
		return false;
	}
};

SignatureIndex::Tree::Tree(const std::vector<CellIndex>& cells_, const SignatureCounts& counts)
    : bins(static_cast<std::size_t>(counts.bins)),
      directions(static_cast<float>(counts.directions)),
      stride(in_whole_lines(bins)),
      projection(counts)
{
	std::vector<ProjectedSignature> projected;
	projected.reserve(cells_.size());
	for (std::size_t i = 0; i < cells_.size(); i++) projected.push_back(projection.project(counts.of(i)));
	projections = std::vector<ProjectedSignature>(projected);
	kd_tree = std::make_unique<KdTree>(kProjectionSize, *this, nanoflann::KDTreeSingleIndexAdaptorParams(kLeafSize));

	// What one leaf refers to is moved next to each other.
	auto& points = points_by_leaf(*kd_tree);
	const std::vector<std::uint32_t> order = points;
	std::iota(points.begin(), points.end(), 0U);
	projections = permuted(projected, order);
	cells = permuted(cells_, order);
	AlignedBytes rows(cells.size() * stride);
	for (std::size_t point = 0; point < cells.size(); point++)
		std::copy_n(counts.of(order[point]), bins, rows.data() + point * stride);
	signatures = std::move(rows);
}

SignatureIndex::Tree::Tree(IndexReader& file)
{
	fields(*this, file);
	Array<char> nodes;
	file(nodes);
	std::istringstream stream(std::string(nodes.begin(), nodes.end()));
	kd_tree = std::make_unique<KdTree>(
	    kProjectionSize, *this,
	    nanoflann::KDTreeSingleIndexAdaptorParams(
	        kLeafSize, nanoflann::KDTreeSingleIndexAdaptorFlags::SkipInitialBuildIndex));
	kd_tree->loadIndex(stream);
}

void SignatureIndex::Tree::save(IndexWriter& file) const
{
	fields(*this, file);
	std::ostringstream stream;
	kd_tree->saveIndex(stream);
	const std::string nodes = stream.str();
	file(Array<char>(std::vector<char>(nodes.begin(), nodes.end())));
}

void SignatureIndex::Tree::fill(ScaledQuery& query, const Signature& signature) const
{
	query.counts.assign(stride, 0);
	for (std::size_t bin = 0; bin < bins; bin++)
	{
		const float count = std::min(signature[bin] * directions, 255.0F);
		query.counts[bin] = static_cast<std::int32_t>(std::lround(count * kFraction));
	}
	query.projected = projection.project(query.counts.data());
	for (float& coordinate : query.projected) coordinate /= kFraction;
}

NearestCell SignatureIndex::Tree::distance(const ScaledQuery& query, std::uint32_t point) const
{
	const std::uint8_t* counts = signatures.data() + point * stride;
	std::int32_t squared = 0;
	for (std::size_t bin = 0; bin < query.counts.size(); bin++)
	{
		const std::int32_t difference = query.counts[bin] - kFraction * counts[bin];
		squared += difference * difference;
	}
	return {cells[point], static_cast<float>(squared) / (kFraction * kFraction)};
}

SignatureIndex::SignatureIndex(
    const Grid& grid, const std::vector<CellIndex>& cells, const Parameters& parameters, int threads)
{
	if (cells.empty()) throw std::invalid_argument("SignatureIndex: there is no free cell");
	tree_ = std::make_unique<const Tree>(cells, count_signatures(grid, cells, parameters, threads));
}

SignatureIndex::SignatureIndex(IndexReader& file) : tree_(std::make_unique<const Tree>(file)) {}

void SignatureIndex::save(IndexWriter& file) const
{
	tree_->save(file);
}

SignatureIndex::~SignatureIndex() = default;
SignatureIndex::SignatureIndex(SignatureIndex&&) noexcept = default;
SignatureIndex& SignatureIndex::operator=(SignatureIndex&&) noexcept = default;

std::vector<NearestCell> SignatureIndex::nearest(const Signature& query, int k) const
{
	std::vector<NearestCell> result;
	nearest(query, k, result);
	return result;
}

void SignatureIndex::nearest(const Signature& signature, int k, std::vector<NearestCell>& result) const
{
	if (signature.size() != tree_->bins)
		throw std::invalid_argument("SignatureIndex: the query has another number of bins than the index");
	if (k < 1) throw std::invalid_argument("SignatureIndex: k must be at least 1");
	thread_local ScaledQuery query;
	tree_->fill(query, signature);
	const auto distance = [this](std::uint32_t point) { return tree_->distance(query, point); };
	NearestByFullDistance nearest(std::min(static_cast<std::size_t>(k), tree_->cells.size()), result, distance);
	tree_->kd_tree->findNeighbors(nearest, query.projected.data(), SearchParameters());
	for (NearestCell& found : result) found.squared_distance /= tree_->directions * tree_->directions;
}
}  // namespace d2s1r
