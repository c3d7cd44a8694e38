// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "node.h"

#include <shell/errors.h>
#include <shell/indexed_maps.h>

#include <chrono>
#include <future>
#include <map>
#include <set>
#include <stdexcept>
#include <thread>
#include <type_traits>

#include "line_budget.h"
#include "maps.h"
#include "messages.h"
#include "rivals.h"
#include "topics.h"

namespace d2s1r::live
{
namespace
{
constexpr int kLongestWait = 50;  // [ms] for messages, between looks at signals

SteadyTime steady_now()
{
	return std::chrono::steady_clock::now();
}

class Node
{
   public:
	Node(const Flags& flags, const Parameters& parameters, std::function<void(const std::string&)> say)
	    : flags_(flags),
	      say_(std::move(say)),
	      domain_(open_domain(flags.domain, flags.discovery.settings)),
	      participant_(join_domain(flags.domain)),
	      topics_(flags, {participant_, flags.names}),
	      publications_(participant_),
	      graph_(participant_, flags.names.node, flags.names.space),
	      live_(settings_of(flags, parameters))
	{
	}

	LiveLocalizer& live() { return live_; }

	void step()
	{
		topics_.waiter.wait(kLongestWait);
		take_peers();
		take(
		    topics_.clock, ros::decode_clock,
		    [&](Time time) { simulated_now_ = ignores_clock_ ? std::nullopt : std::optional(time); });
		send(live_.update(now()));  // before messages of a time to which the clock ran back
		take_messages();
		look_for_rivals();  // before a seed may be made of what they say
		send(live_.update(now()));
		send_tracked();
		auto status = live_.status(now());
		if (!status.is_localized) status.summary += hint_;
		const bool is_due = steady_now() - told_at_ >= std::chrono::seconds(1);
		if (is_due || status.summary != told_summary_) send(status);
		if (is_due) once_a_second();
		for (const NewsLine& line : live_.take_news()) say(line.text, line.peer);
		say_if_stuck(status);
	}

   private:
	static LiveSettings settings_of(const Flags& flags, const Parameters& parameters)
	{
		LiveSettings settings = flags.settings;
		settings.parameters = parameters;
		settings.make_localizer = localizers_with_index(flags.index);
		return settings;
	}

	/// \param peer whose message gave rise to the line, or what of this program it is about
	void say(const std::string& line, std::uint64_t peer = 0)
	{
		if (flags_.quiet) return;
		if (const std::string passed = budget_.pass(peer, line, steady_now()); !passed.empty()) say_(passed);
	}

	Time now() const { return simulated_now_ ? *simulated_now_ : wall_clock(); }

	void take_peers()
	{
		live_.set_map_publishers(topics_.maps.publisher_ids());
		const Peers readers = topics_.seeds.readers();
		live_.set_tracker_readers(readers.present, readers.ever);
		live_.set_odometry_publishers(topics_.odometry.publishers().present);
		if (topics_.clock.publishers().present > 0) return;
		simulated_now_.reset();
		ignores_clock_ = flags_.ignores_clock;
	}

	/// Looks whether the scans go by the clock of this machine, and not by /clock.
	void check_clock(Time scan)
	{
		constexpr Time kOfOneClock = 10 * kSecond;
		const auto goes_by = [&](Time clock) { return std::abs(scan - clock) < kOfOneClock; };
		if (!simulated_now_ || goes_by(*simulated_now_) || !goes_by(wall_clock())) return;
		say("somebody publishes " + topics_.clock.topic() + ", but the scans do not go by it: it is not followed");
		simulated_now_.reset();
		ignores_clock_ = true;
	}

	void take_messages()
	{
		take_motion();
		take(
		    topics_.maps, ros::decode_occupancy_grid,
		    [&](const ros::OccupancyGrid& map, PublisherId publisher) { live_.add_map(map, publisher); });
		for (Reader& tracker : topics_.trackers)
			take_of_one(
			    tracker, ros::decode_stamped_pose,
			    [&](const ros::StampedPose& pose) { live_.add_tracker_pose(pose.header, pose.pose); });
		if (topics_.suggestions)
			take(
			    *topics_.suggestions, ros::decode_stamped_pose,
			    [&](const ros::StampedPose& pose) { live_.suggest(pose.header, pose.pose); });
		topics_.requests.take([&](ros::Bytes, PublisherId) { live_.request(); });
		for (Reader& scans : topics_.scans) take_scans(scans);
	}

	/// Takes where the laser is, and how the robot moves.
	void take_motion()
	{
		take(
		    topics_.static_transforms, ros::decode_transforms,
		    [&](const auto& transforms, PublisherId publisher)
		    {
			    check_tracked(topics_.static_transforms, transforms, publisher);
			    live_.add_transforms(transforms, true);
		    });
		take(
		    topics_.transforms, ros::decode_transforms,
		    [&](const auto& transforms, PublisherId publisher)
		    {
			    for (const ros::Transform& transform : transforms)
				    if (transform.pose)
					    rivals_.hear(
					        "the transform of '" + transform.child + "'", publisher,
					        mrpt::poses::CPose2D(*transform.pose), steady_now());
			    check_tracked(topics_.transforms, transforms, publisher);
			    live_.add_transforms(transforms, false);
		    });
		take_of_one(
		    topics_.odometry, ros::decode_odometry,
		    [&](const ros::Odometry& odometry) { live_.add_odometry(odometry); });
	}

	void check_tracked(const Reader& reader, const std::vector<ros::Transform>& transforms, PublisherId publisher) const
	{
		for (const ros::Transform& transform : transforms)
			if (flags_.settings.track && live_.is_map_to_odometry(transform))
				throw app::UserError(
				    app::kWrongUse, "--track",
				    printable(
				        reader.name_of(publisher) + " publishes " + transform.header.frame + " -> " + transform.child +
				        " on " + reader.topic() + " already; stop it, or leave --track out"));
	}

	void take_scans(Reader& reader)
	{
		if (flags_.settings.cloud_height)
			take_of_one(
			    reader, ros::decode_point_cloud,
			    [&](const ros::PointCloud& cloud)
			    {
				    check_clock(cloud.header.time);
				    live_.add_cloud(reader.topic(), cloud);
			    });
		else
			take_of_one(
			    reader, ros::decode_laser_scan,
			    [&](const ros::LaserScan& scan)
			    {
				    check_clock(scan.header.time);
				    live_.add_scan(reader.topic(), scan);
			    });
	}

	/// Takes messages of a topic that a robot has one publisher of.
	template <typename Decode, typename Use>
	void take_of_one(Reader& reader, const Decode& decode, const Use& use)
	{
		take(
		    reader, decode,
		    [&](const auto& message, PublisherId publisher)
		    {
			    rivals_.hear(reader.topic(), publisher, steady_now());
			    use(message);
		    });
	}

	/// Decodes what has come on a topic and hands it over, with the publisher if `use` asks for it. Messages that are
	/// damaged are left out, which is told once for each topic.
	template <typename Decode, typename Use>
	void take(Reader& reader, const Decode& decode, const Use& use)
	{
		reader.take(
		    [&](ros::Bytes bytes, PublisherId publisher)
		    {
			    std::optional<decltype(decode({}))> message;
			    try
			    {
				    message = decode({bytes, ros::Encoding::kCdr});
			    }
			    catch (const std::runtime_error& e)
			    {
				    if (std::exchange(damaged_[reader.topic()], publisher) != publisher)
					    say(reader.topic() + ": a message is left out: " + one_line(e), publisher);
				    return;
			    }
			    live_.hear(publisher);
			    if constexpr (std::is_invocable_v<Use, decltype(*message), PublisherId>)
				    use(*message, publisher);
			    else
				    use(*message);
		    });
	}

	void send(const std::vector<ScanAnswer>& answers)
	{
		for (const ScanAnswer& answer : answers) send(answer);
	}

	/// Sends where the robot is now, for a machine that is busy may have taken long for the scan.
	void send(const Seed& made)
	{
		take_motion();
		const Seed seed = live_.carried(made);
		topics_.seeds.write(pose_message(seed.time, seed.frame, seed.pose, seed.covariance).message);
	}

	void send(const ScanAnswer& answer)
	{
		if (answer.seed) send(*answer.seed);
		const bool is_sent_later = topics_.tracked_transforms && live_.has_odometry();
		if (answer.localization.status == Status::kLocalized && !is_sent_later)
		{
			const Hypothesis& best = answer.localization.best();
			topics_.poses.write(pose_message(answer.time, answer.frame, best.pose, best.covariance).message);
		}
		topics_.hypotheses.write(hypotheses_message(answer).message);
		topics_.markers.write(markers_message(answer).message);
	}

	/// Sends where the robot is at the newest reading of the odometry, with --track.
	void send_tracked()
	{
		constexpr Time kTolerance = kSecond;  // [ns] as amcl's transform_tolerance is
		if (!topics_.tracked_transforms) return;
		const auto tracked = live_.take_tracked();
		if (!tracked) return;
		const auto message = transform_message(
		    tracked->time + kTolerance, tracked->map_frame, tracked->odometry_frame, tracked->odometry);
		topics_.tracked_transforms->write(message.message);
		topics_.poses.write(
		    pose_message(tracked->time, tracked->map_frame, tracked->robot, tracked->covariance).message);
	}

	void send(const LiveStatus& status)
	{
		topics_.diagnostics.write(diagnostics_message(now(), status, flags_.names.space).message);
		told_summary_ = status.summary;
		told_at_ = steady_now();
	}

	void say_if_stuck(const LiveStatus& status)
	{
		constexpr std::chrono::seconds kPatience(3);
		const std::string reason = status.is_localized ? "" : status.summary;
		if (reason != stuck_by_)
		{
			stuck_by_ = reason;
			stuck_since_ = steady_now();
			is_said_ = reason.empty();
		}
		if (is_said_ || steady_now() - stuck_since_ < kPatience) return;
		is_said_ = true;
		say("domain " + std::to_string(flags_.domain) + ": " + reason);
	}

	void once_a_second()
	{
		const auto readers = topics_.readers(), writers = topics_.writers();
		publications_.update();
		graph_.update(publications_, readers, writers);
		has_two_trackers_ = tracker_count_.are_several(trackers_that_read_seeds(), steady_now());
		hint_ = hint_on_topics();
		for (const auto* all : {&readers, &writers})
			for (Endpoint* endpoint : *all)
			{
				std::string line = endpoint->new_mismatch();
				if (endpoint == &topics_.maps && !line.empty() && !flags_.volatile_map)
					line += "; if it publishes once, start it after this program with --map-volatile";
				if (!line.empty()) say(line, static_cast<std::uint64_t>(endpoint->entity()));
			}
	}

	/// Tells the localizer whether messages of two robots come.
	void look_for_rivals()
	{
		std::string what = rivals_.thing(steady_now());
		if (!what.empty()) what = "two nodes publish " + what;
		if (has_two_trackers_ && what.empty()) what = "two trackers read seeds on " + topics_.seeds.topic();
		if (!what.empty()) what += ": give each robot a namespace or a domain of its own, or stop one of them";
		live_.set_rivals(what);
	}

	/// Returns the number of participants that read seeds and publish what trackers do. Recorders and tools publish
	/// nothing of the kind.
	std::size_t trackers_that_read_seeds() const
	{
		std::set<std::string> of_trackers = {wire_name(topics_.transforms.topic())};
		for (const Reader& tracker : topics_.trackers) of_trackers.insert(wire_name(tracker.topic()));
		const auto readers = topics_.seeds.participants();
		std::set<ParticipantKey> found;
		for (const auto& [handle, publication] : publications_.all())
			if (of_trackers.count(publication.topic) > 0 && readers.count(publication.participant) > 0)
				found.insert(publication.participant);
		return found.size();
	}

	/// Returns what to write if nobody publishes the scans or the map that are read, but others of the kind; else an
	/// empty text.
	std::string hint_on_topics() const
	{
		const auto hint = [&](const Reader& reader, const dds_topic_descriptor_t& type, const std::string& option)
		{
			constexpr std::size_t kMostNamed = 3;
			const auto others = publications_.topics_of(type.m_typename, reader.topic());
			if (reader.publishers().present > 0 || others.empty()) return std::string();
			std::string names;
			for (std::size_t i = 0; i < std::min(others.size(), kMostNamed); i++)
				names += (i > 0 ? ", " : "") + printable(others[i]);
			return "; nobody publishes " + reader.topic() + ", but " + names + ": name it by " + option;
		};
		const auto& of_scans = flags_.settings.cloud_height ? sensor_msgs_msg_dds__PointCloud2__desc
		                                                    : sensor_msgs_msg_dds__LaserScan__desc;
		const std::string of_map =
		    flags_.map.empty() ? hint(topics_.maps, nav_msgs_msg_dds__OccupancyGrid__desc, "--map-topic") : "";
		return of_map + hint(topics_.scans.front(), of_scans, "--scan");
	}

	const Flags& flags_;
	std::function<void(const std::string&)> say_;
	Entity domain_, participant_;
	Topics topics_;
	Publications publications_;
	Graph graph_;
	Rivals rivals_;
	TrackerCount tracker_count_;
	bool has_two_trackers_ = false;
	LineBudget budget_;
	std::string hint_;  //!< on topics that may be meant
	LiveLocalizer live_;
	std::optional<Time> simulated_now_;  //!< of /clock
	bool ignores_clock_ = flags_.ignores_clock;
	std::map<std::string, PublisherId> damaged_;  //!< who sent the last damaged message of a topic
	std::string told_summary_;
	SteadyTime told_at_{};
	std::string stuck_by_;  //!< why the robot is not localized; empty if it is
	bool is_said_ = true;
	SteadyTime stuck_since_{};
};

/// Does what may take long, or wait for a pipe. The process ends without waiting for it if it is told to.
template <typename Result, typename Work>
std::future<Result> on_a_thread(Work work)
{
	std::packaged_task<Result()> task(std::move(work));
	std::future<Result> result = task.get_future();
	std::thread(std::move(task)).detach();
	return result;
}
}  // namespace

app::ExitStatus serve(
    const Flags& flags, const std::function<void(const std::string& line)>& say, const std::function<bool()>& stop)
{
	for (const std::string& note : flags.notes)
		if (!flags.quiet) say(printable(note));
	if (!flags.index.empty()) app::check_index_file(flags.index);
	auto reading = on_a_thread<Parameters>([config = flags.config, settings = flags.parameters]
	                                       { return read_parameters(config, settings); });
	while (reading.wait_for(std::chrono::milliseconds(20)) != std::future_status::ready)
		if (stop()) return app::kDone;
	const Parameters parameters = reading.get();
	Node node(flags, parameters, say);
	std::future<LoadedMaps> maps;
	if (!flags.map.empty())
		maps = on_a_thread<LoadedMaps>([flags, parameters] { return load_maps(flags, parameters); });
	while (!stop())
	{
		if (maps.valid() && maps.wait_for(std::chrono::seconds(0)) == std::future_status::ready)
		{
			const LoadedMaps loaded = maps.get();
			node.live().use_maps(loaded.atlas);
			if (!loaded.note.empty() && !flags.quiet) say(loaded.note);
		}
		node.step();
	}
	return app::kDone;
}
}  // namespace d2s1r::live
