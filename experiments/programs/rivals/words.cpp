// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Bag of words and geometrical FLIRT phrases.
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <random>

#include "flirt.h"

namespace d2s1r::rivals
{
namespace
{
constexpr std::size_t kWords = 100;         // [-] our choice
constexpr std::size_t kMostSamples = 1000;  // [-] descriptors from which the words are learned, as in GFLIP
constexpr int kIterations = 30;             // [-] of k-means, as in the authors' GFLIP

using Words = std::vector<std::size_t>;  // of the keypoints of a scan, in the order of its beams

std::size_t nearest(const std::vector<Descriptor>& centres, const Descriptor& descriptor)
{
	std::size_t best = 0;
	double least = std::numeric_limits<double>::infinity();
	for (std::size_t i = 0; i < centres.size(); i++)
		if (const double distance = descriptor_distance(centres[i], descriptor); distance < least)
			least = distance, best = i;
	return best;
}

/// K-means.
std::vector<Descriptor> learn_words(std::vector<Descriptor> samples)
{
	std::mt19937 generator(1);
	std::shuffle(samples.begin(), samples.end(), generator);
	if (samples.size() > kMostSamples) samples.resize(kMostSamples);
	std::vector<Descriptor> centres(
	    samples.begin(), samples.begin() + static_cast<std::ptrdiff_t>(std::min(kWords, samples.size())));
	for (int iteration = 0; iteration < kIterations; iteration++)
	{
		std::vector<Descriptor> sums(centres.size(), Descriptor{});
		std::vector<float> counts(centres.size(), 0);
		for (const Descriptor& sample : samples)
		{
			const std::size_t word = nearest(centres, sample);
			counts[word] += 1;
			for (std::size_t i = 0; i < sample.size(); i++) sums[word][i] += sample[i];
		}
		for (std::size_t word = 0; word < centres.size(); word++)
			if (counts[word] > 0)
				for (std::size_t i = 0; i < sums[word].size(); i++) centres[word][i] = sums[word][i] / counts[word];
	}
	return centres;
}

/// The keyframes as texts.
struct Library
{
	std::vector<Descriptor> centres;               //!< of the words
	std::vector<std::vector<Keypoint>> keypoints;  //!< of each keyframe
	std::vector<Words> texts;                      //!< of each keyframe
	std::vector<mrpt::math::TPose2D> sensors;      //!< of each keyframe, sensor in map
	std::vector<double> idf;                       //!< [nat] of each word, log(N / N with the word)
	std::vector<double> norms;                     //!< of each keyframe, which the scores are divided by
};

Words read(const Library& library, const std::vector<Keypoint>& keypoints)
{
	Words words;
	for (const Keypoint& keypoint : keypoints) words.push_back(nearest(library.centres, keypoint.descriptor));
	return words;
}

Library make_library(const std::vector<Keyframe>& keyframes)
{
	Library library;
	std::vector<Descriptor> samples;
	for (const Keyframe& keyframe : keyframes)
	{
		library.keypoints.push_back(find_keypoints(keyframe.scan));
		library.sensors.push_back(keyframe.sensor);
		for (const Keypoint& keypoint : library.keypoints.back()) samples.push_back(keypoint.descriptor);
	}
	library.centres = learn_words(std::move(samples));
	std::vector<double> with_word(library.centres.size(), 0.0);
	for (const auto& keypoints : library.keypoints)
	{
		const Words& words = library.texts.emplace_back(read(library, keypoints));
		for (std::size_t word = 0; word < with_word.size(); word++)
			with_word[word] += std::count(words.begin(), words.end(), word) > 0 ? 1 : 0;
	}
	for (const double n : with_word)
		library.idf.push_back(n > 0 ? std::log(static_cast<double>(keyframes.size()) / n) : 0);
	return library;
}

/// Term frequency times inverse document frequency, of every word.
std::vector<double> tf_idf(const Library& library, const Words& words)
{
	std::vector<double> weights(library.centres.size(), 0.0);
	for (const std::size_t word : words) weights[word] += library.idf[word] / static_cast<double>(words.size());
	return weights;
}

double word_score(const Library& library, const Words& a, const Words& b)
{
	const auto u = tf_idf(library, a), v = tf_idf(library, b);
	return std::inner_product(u.begin(), u.end(), v.begin(), 0.0);
}

/// The weights of all phrases of two words (GFLIP's kernel) that both texts have: words that are displaced by as many
/// places as each other. Among n such words each is in n - 1 phrases.
double phrase_score(const Library& library, const Words& a, const Words& b)
{
	std::vector<double> counts(a.size() + b.size(), 0.0), weights(a.size() + b.size(), 0.0);  // by displacement
	for (std::size_t i = 0; i < a.size(); i++)
		for (std::size_t j = 0; j < b.size(); j++)
			if (a[i] == b[j])
			{
				counts[i + b.size() - j] += 1;
				weights[i + b.size() - j] += library.idf[a[i]];
			}
	double sum = 0;
	for (std::size_t i = 0; i < counts.size(); i++)
		if (counts[i] > 1) sum += weights[i] * (counts[i] - 1);
	return sum;
}

using Score = double (*)(const Library&, const Words&, const Words&);

Rival make_rival(const std::vector<Keyframe>& keyframes, Score score)
{
	auto made = std::make_shared<Library>(make_library(keyframes));
	for (const Words& text : made->texts) made->norms.push_back(std::sqrt(score(*made, text, text)));
	const std::shared_ptr<const Library> library = made;
	return [library, score](const Scan& scan)
	{
		const auto keypoints = find_keypoints(scan);
		if (library->centres.empty()) return std::optional<mrpt::math::TPose2D>();  // no keyframe has a keypoint
		const Words words = read(*library, keypoints);
		std::vector<std::pair<double, std::size_t>> ranked;  // the query's own norm is the same for all
		for (std::size_t i = 0; i < library->texts.size(); i++)
			if (library->norms[i] > 0)
				ranked.emplace_back(-score(*library, words, library->texts[i]) / library->norms[i], i);
		const std::size_t count = std::min(kRetrieved, ranked.size());
		std::partial_sort(ranked.begin(), ranked.begin() + static_cast<std::ptrdiff_t>(count), ranked.end());
		std::vector<std::size_t> best;
		for (std::size_t i = 0; i < count; i++) best.push_back(ranked[i].second);
		return align_with_best(keypoints, best, library->keypoints, library->sensors);
	};
}
}  // namespace

Rival bag_of_words(const std::vector<Keyframe>& keyframes)
{
	return make_rival(keyframes, word_score);
}

Rival flirt_phrases(const std::vector<Keyframe>& keyframes)
{
	return make_rival(keyframes, phrase_score);
}
}  // namespace d2s1r::rivals
