// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
// Topics of ROS 2 by Cyclone DDS alone: names, types and qualities of service as ROS's middleware puts them on the
// wire.
#pragma once

#include <dds/dds.h>
#include <ros/bytes.h>

#include <array>
#include <cstdint>
#include <functional>
#include <set>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "ros_arguments.h"

namespace d2s1r::live
{
struct Quality
{
	bool reliable = true;
	bool transient_local = false;
	int depth = 10;            //!< [-] samples that are kept
	bool ignores_own = false;  //!< whether a reader leaves out what this program publishes
};

std::string wire_name(const std::string& topic);

/// An entity that is deleted with its owner.
class Entity
{
   public:
	explicit Entity(dds_entity_t handle = 0) : handle_(handle) {}
	~Entity()
	{
		if (handle_ > 0) dds_delete(handle_);
	}
	Entity(Entity&& other) noexcept : handle_(std::exchange(other.handle_, 0)) {}
	Entity& operator=(Entity&& other) noexcept
	{
		std::swap(handle_, other.handle_);
		return *this;
	}
	operator dds_entity_t() const { return handle_; }

   private:
	dds_entity_t handle_;
};

/// Sends what Cyclone DDS says to `say`, for as long as the process runs, a line at a time.
void redirect_log(std::function<void(const std::string& line)> say);

/// Opens a domain with the first of some settings that Cyclone DDS accepts, and those of CYCLONEDDS_URI. A writer that
/// ends waits for its readers for a moment only, so that peers that have died do not hold up the end of the program.
/// \throws UserError (kBadInput)
Entity open_domain(std::uint32_t domain, const std::vector<std::string>& settings);

/// Joins a domain. \throws UserError (kBadInput)
Entity join_domain(std::uint32_t domain);

/// Where a node's readers and writers are.
struct Place
{
	dds_entity_t participant = 0;
	Names names{};  //!< which resolve those of its topics
};

/// A reader or a writer, and what is told of its peers.
class Endpoint
{
   public:
	const std::string& topic() const { return topic_; }
	dds_entity_t entity() const { return entity_; }

	/// Returns a line if since the last call a peer was seen whose quality of service does not match; else nothing.
	std::string new_mismatch();

   protected:
	using Create = dds_entity_t (&)(dds_entity_t, dds_entity_t, const dds_qos_t*, const dds_listener_t*);
	Endpoint(
	    const Place& place, const dds_topic_descriptor_t& type, const std::string& topic, const Quality& quality,
	    Create create);

   private:
	std::string topic_;
	Entity entity_;
	bool is_reader_;
	std::uint32_t mismatches_ = 0;
};

using ParticipantKey = std::array<unsigned char, 16>;

struct Peers
{
	int present = 0;
	int ever = 0;
};

class Reader : public Endpoint
{
   public:
	/// \throws UserError (kBadInput)
	Reader(const Place& place, const dds_topic_descriptor_t& type, const std::string& topic, const Quality& asked);
	Peers publishers() const;

	/// Returns names of the publishers that are there, which differ from those of all others that ever were.
	std::vector<std::uint64_t> publisher_ids() const;

	/// Returns the name of the process of a publisher, for people; if it does not tell that, its identifier.
	std::string name_of(std::uint64_t publisher) const;

	/// Hands over messages that have come, oldest first, each as it was sent, with the name of its publisher. Cyclone
	/// DDS has checked that they are of the type. It returns after some milliseconds even if more come all the time.
	void take(const std::function<void(ros::Bytes message, std::uint64_t publisher)>& use);
};

class AnyWriter : public Endpoint
{
   public:
	/// \throws UserError (kBadInput)
	AnyWriter(const Place& place, const dds_topic_descriptor_t& type, const std::string& topic, const Quality& offered);
	Peers readers() const;

	/// Returns the participants that the readers are of.
	std::set<ParticipantKey> participants() const;

   protected:
	void send(const void* sample);
};

template <typename Message>
class Writer : public AnyWriter
{
   public:
	using AnyWriter::AnyWriter;
	void write(const Message& message) { send(&message); }
};

/// Waits until one of the readers has something, or for `milliseconds`.
class Waiter
{
   public:
	explicit Waiter(dds_entity_t participant);
	void add(const Endpoint& reader);
	void wait(int milliseconds);

   private:
	Entity waitset_;
	std::vector<Entity> conditions_;
};

/// Knows what the other participants publish.
class Publications
{
   public:
	explicit Publications(dds_entity_t participant);

	struct Publication
	{
		ParticipantKey participant;
		std::string topic, type;  //!< as they are on the wire
		bool has_hash = false;    //!< of its type, as Iron and later tell it
	};

	/// Takes what has come and gone since the last call, up to some thousands.
	void update();

	/// Returns what is published now, in no order.
	const std::unordered_map<std::uint64_t, Publication>& all() const { return all_; }

	/// Returns the topics of ROS of a type, in their order, except `other`.
	std::vector<std::string> topics_of(const std::string& type, const std::string& other) const;

   private:
	ParticipantKey own_{};
	Entity reader_;
	std::unordered_map<std::uint64_t, Publication> all_;
};

/// Says which nodes there are, so that tools show this one by its name. It is silent until it knows how long the peers'
/// identifiers are, and while they do not agree: a wrong length breaks the peers' own lists.
class Graph
{
   public:
	/// \param space namespace of the node
	Graph(dds_entity_t participant, std::string node, std::string space);

	/// Tells the peers of these endpoints, if that is safe. Call it once a second.
	void update(
	    const Publications& publications, const std::vector<Endpoint*>& readers, const std::vector<Endpoint*>& writers);

   private:
	dds_entity_t participant_;
	std::string node_, space_;
	int size_ = 0;
	std::size_t told_ = 0;
	Entity writer_;
};
}  // namespace d2s1r::live
