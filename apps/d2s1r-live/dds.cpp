// d2s1r: one-shot global localization with a 2D LiDAR. SPDX-License-Identifier: BSD-3-Clause
#include "dds.h"

#include <dds/ddsi/ddsi_serdata.h>
#include <dds/ddsrt/log.h>
#include <mrpt/core/format.h>
#include <shell/errors.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <map>
#include <memory>

#include "graph16.h"
#include "messages.h"

namespace d2s1r::live
{
namespace
{
constexpr std::size_t kMostTaken = 8;  // [-] samples at once
constexpr char kGraphTopic[] = "ros_discovery_info";

struct DeleteQos
{
	void operator()(dds_qos_t* qos) const { dds_delete_qos(qos); }
};
using Qos = std::unique_ptr<dds_qos_t, DeleteQos>;

struct ReleaseSample
{
	void operator()(ddsi_serdata* sample) const { ddsi_serdata_unref(sample); }
};

Qos qos_of(const Quality& quality)
{
	constexpr dds_duration_t kLongestBlocking = DDS_MSECS(100);
	Qos qos(dds_create_qos());
	dds_qset_reliability(
	    qos.get(), quality.reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT, kLongestBlocking);
	dds_qset_durability(qos.get(), quality.transient_local ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
	dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, quality.depth);
	dds_qset_writer_data_lifecycle(qos.get(), false);
	if (quality.ignores_own) dds_qset_ignorelocal(qos.get(), DDS_IGNORELOCAL_PARTICIPANT);
	const dds_data_representation_id_t plain = DDS_DATA_REPRESENTATION_XCDR1;
	dds_qset_data_representation(qos.get(), 1, &plain);
	return qos;
}

std::string policy_name(std::uint32_t id)
{
	static const std::map<std::uint32_t, const char*> names = {
	    {2, "durability"}, {4, "deadline"},     {5, "latency budget"},      {6, "ownership"},
	    {8, "liveliness"}, {11, "reliability"}, {23, "data representation"}};
	const auto found = names.find(id);
	return (found != names.end() ? found->second : "policy") + (" (policy " + std::to_string(id) + ")");
}

/// Returns the entity. \throws UserError if there is none, because of what `handle` says then
Entity checked(dds_entity_t handle, const std::string& what)
{
	if (handle < 0)
		throw app::UserError(
		    app::kBadInput, what,
		    std::string("DDS: ") + dds_strretcode(handle) + "; check ROS_DOMAIN_ID and CYCLONEDDS_URI");
	return Entity(handle);
}

dds_entity_t make_topic(dds_entity_t participant, const dds_topic_descriptor_t& type, const std::string& name)
{
	const dds_entity_t topic = dds_create_topic(participant, &type, name.c_str(), nullptr, nullptr);
	if (topic < 0) checked(topic, name);
	return topic;
}

std::function<void(const std::string&)>& log_sink()
{
	static std::function<void(const std::string&)> sink;
	return sink;
}

void write_log(void*, const dds_log_data_t* data)
{
	std::string line(data->message, data->size);
	while (!line.empty() && (line.back() == '\n' || line.back() == ' ')) line.pop_back();
	// Settings of localhost ask for that.
	const bool is_asked_for = line.find("is not multicast-capable") != std::string::npos;
	if (log_sink() && !is_asked_for) log_sink()(printable(line));
}
}  // namespace

std::string wire_name(const std::string& topic)
{
	return "rt/" + (topic.rfind('/', 0) == 0 ? topic.substr(1) : topic);
}

void redirect_log(std::function<void(const std::string& line)> say)
{
	log_sink() = std::move(say);
	dds_set_log_sink(write_log, nullptr);
	dds_set_trace_sink([](void*, const dds_log_data_t*) {}, nullptr);
}

Entity open_domain(std::uint32_t domain, const std::vector<std::string>& settings)
{
	const char* const given = std::getenv("CYCLONEDDS_URI");
	dds_entity_t opened = DDS_RETCODE_ERROR;
	for (std::size_t i = 0; i < settings.size() && opened < 0; i++)
	{
		const std::string all =
		    "<CycloneDDS><Domain><Internal><WriterLingerDuration>20 ms</WriterLingerDuration></Internal></Domain>"
		    "</CycloneDDS>," +
		    settings[i] + "," + std::string(given != nullptr ? given : "");
		opened = dds_create_domain(domain, all.c_str());
	}
	return checked(opened, "domain " + std::to_string(domain));
}

Entity join_domain(std::uint32_t domain)
{
	Qos qos(dds_create_qos());
	const std::string enclave = "enclave=/;";
	dds_qset_userdata(qos.get(), enclave.data(), enclave.size());
	return checked(dds_create_participant(domain, qos.get(), nullptr), "domain " + std::to_string(domain));
}

namespace
{
ParticipantKey key_of(const dds_guid_t& guid)
{
	ParticipantKey key{};
	std::copy(std::begin(guid.v), std::end(guid.v), key.begin());
	return key;
}

/// Returns all peers of a reader or writer, by the function that tells some of them and how many they are.
template <typename Get>
std::vector<dds_instance_handle_t> matched(dds_entity_t entity, const Get& get)
{
	std::vector<dds_instance_handle_t> handles(static_cast<std::size_t>(std::max(0, get(entity, nullptr, 0))));
	const auto count = handles.empty() ? 0 : get(entity, handles.data(), handles.size());
	handles.resize(std::min(handles.size(), static_cast<std::size_t>(std::max(0, count))));
	return handles;
}
}  // namespace

std::string Endpoint::new_mismatch()
{
	const auto look = [&](auto status, const auto& get)
	{
		get(entity_, &status);
		return std::pair(status.total_count, status.last_policy_id);
	};
	const auto [count, policy] =
	    is_reader_ ? look(dds_requested_incompatible_qos_status_t{}, dds_get_requested_incompatible_qos_status)
	               : look(dds_offered_incompatible_qos_status_t{}, dds_get_offered_incompatible_qos_status);
	if (count == mismatches_) return "";
	mismatches_ = count;
	return topic_ + ": a " + (is_reader_ ? "publisher" : "subscriber") +
	       " is there whose quality of service does not match: " + policy_name(policy);
}

Endpoint::Endpoint(
    const Place& place, const dds_topic_descriptor_t& type, const std::string& topic, const Quality& quality,
    Create create)
    : topic_(place.names.resolve(topic)),
      entity_(checked(
          create(
              place.participant, make_topic(place.participant, type, wire_name(topic_)), qos_of(quality).get(),
              nullptr),
          topic_)),
      is_reader_(&create == &dds_create_reader)
{
}

Reader::Reader(const Place& place, const dds_topic_descriptor_t& type, const std::string& topic, const Quality& asked)
    : Endpoint(place, type, topic, asked, dds_create_reader)
{
}

Peers Reader::publishers() const
{
	dds_subscription_matched_status_t status{};
	dds_get_subscription_matched_status(entity(), &status);
	return {static_cast<int>(status.current_count), static_cast<int>(status.total_count)};
}

std::vector<std::uint64_t> Reader::publisher_ids() const
{
	return matched(entity(), dds_get_matched_publications);
}

std::string Reader::name_of(std::uint64_t publisher) const
{
	const std::unique_ptr<dds_builtintopic_endpoint_t, void (*)(dds_builtintopic_endpoint_t*)> data(
	    dds_get_matched_publication_data(entity(), publisher), dds_builtintopic_free_endpoint);
	if (!data) return "a publisher that has gone";
	const Entity participants(
	    dds_create_reader(dds_get_participant(entity()), DDS_BUILTIN_TOPIC_DCPSPARTICIPANT, nullptr, nullptr));
	void* sample = nullptr;
	dds_sample_info_t info{};
	std::string name;
	if (dds_read_instance(participants, &sample, &info, 1, 1, data->participant_instance_handle) == 1)
	{
		char* value = nullptr;
		const auto* participant = static_cast<const dds_builtintopic_participant_t*>(sample);
		if (dds_qget_prop(participant->qos, "__ProcessName", &value) && value != nullptr) name = value;
		dds_free(value);
		dds_return_loan(participants, &sample, 1);
	}
	if (!name.empty()) return "'" + name + "'";
	for (const std::uint8_t byte : data->participant_key.v) name += mrpt::format("%02x", byte);
	return "the participant " + name.substr(0, 24);
}

void Reader::take(const std::function<void(ros::Bytes message, std::uint64_t publisher)>& use)
{
	std::array<ddsi_serdata*, kMostTaken> samples{};
	std::array<dds_sample_info_t, kMostTaken> infos{};
	// Others must be heard, too, while somebody floods this topic; what waits is as much as its quality of service
	// keeps.
	const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(20);
	for (int taken = kMostTaken; taken == static_cast<int>(kMostTaken) && std::chrono::steady_clock::now() < end;)
	{
		taken = dds_takecdr(entity(), samples.data(), kMostTaken, infos.data(), DDS_ANY_STATE);
		for (int i = 0; i < taken; i++)
		{
			const auto at = static_cast<std::size_t>(i);
			const std::unique_ptr<ddsi_serdata, ReleaseSample> sample(samples[at]);
			ddsrt_iovec_t bytes{};
			if (!infos[at].valid_data) continue;
			ddsi_serdata* const held =
			    ddsi_serdata_to_ser_ref(sample.get(), 0, ddsi_serdata_size(sample.get()), &bytes);
			use({static_cast<const std::uint8_t*>(bytes.iov_base), bytes.iov_len}, infos[at].publication_handle);
			ddsi_serdata_to_ser_unref(held, &bytes);
		}
	}
}

AnyWriter::AnyWriter(
    const Place& place, const dds_topic_descriptor_t& type, const std::string& topic, const Quality& offered)
    : Endpoint(place, type, topic, offered, dds_create_writer)
{
}

Peers AnyWriter::readers() const
{
	dds_publication_matched_status_t status{};
	dds_get_publication_matched_status(entity(), &status);
	return {static_cast<int>(status.current_count), static_cast<int>(status.total_count)};
}

void AnyWriter::send(const void* sample)
{
	dds_write(entity(), sample);
}

Waiter::Waiter(dds_entity_t participant) : waitset_(checked(dds_create_waitset(participant), "waitset")) {}

void Waiter::add(const Endpoint& reader)
{
	conditions_.push_back(checked(dds_create_readcondition(reader.entity(), DDS_ANY_STATE), reader.topic()));
	dds_waitset_attach(waitset_, conditions_.back(), 0);
}

void Waiter::wait(int milliseconds)
{
	std::array<dds_attach_t, 32> triggered{};
	dds_waitset_wait(waitset_, triggered.data(), triggered.size(), DDS_MSECS(milliseconds));
}

std::set<ParticipantKey> AnyWriter::participants() const
{
	std::set<ParticipantKey> keys;
	for (const dds_instance_handle_t handle : matched(entity(), dds_get_matched_subscriptions))
		if (auto* const endpoint = dds_get_matched_subscription_data(entity(), handle))
		{
			keys.insert(key_of(endpoint->participant_key));
			dds_builtintopic_free_endpoint(endpoint);
		}
	return keys;
}

Graph::Graph(dds_entity_t participant, std::string node, std::string space)
    : participant_(participant), node_(std::move(node)), space_(std::move(space))
{
}

namespace
{
std::string user_data_of(const dds_qos_t* qos)
{
	void* value = nullptr;
	std::size_t size = 0;
	if (!dds_qget_userdata(qos, &value, &size) || value == nullptr) return "";
	const std::string text(static_cast<const char*>(value), size);
	dds_free(value);
	return text;
}

template <typename Info, typename Node, typename Gid>
void write_graph(
    dds_entity_t participant, dds_entity_t writer, std::string name, std::string space,
    const std::vector<Endpoint*>& readers, const std::vector<Endpoint*>& writers)
{
	const auto gid_of = [](dds_entity_t entity)
	{
		Gid gid{};
		dds_guid_t guid{};
		dds_get_guid(entity, &guid);
		std::memcpy(gid.data, guid.v, sizeof guid.v);  // and zeros after it
		return gid;
	};
	const auto gids_of = [&](const std::vector<Endpoint*>& endpoints)
	{
		std::vector<Gid> gids;
		for (const Endpoint* endpoint : endpoints) gids.push_back(gid_of(endpoint->entity()));
		return gids;
	};
	auto reader_gids = gids_of(readers), writer_gids = gids_of(writers);
	Node node{};
	node.node_namespace = space.data();
	node.node_name = name.data();
	point_to(node.reader_gid_seq, reader_gids);
	point_to(node.writer_gid_seq, writer_gids);
	Info info{};
	info.gid = gid_of(participant);
	info.node_entities_info_seq._buffer = &node;
	info.node_entities_info_seq._length = info.node_entities_info_seq._maximum = 1;
	dds_write(writer, &info);
}
}  // namespace

Publications::Publications(dds_entity_t participant)
    : reader_(
          checked(dds_create_reader(participant, DDS_BUILTIN_TOPIC_DCPSPUBLICATION, nullptr, nullptr), "publications"))
{
	dds_guid_t own{};
	dds_get_guid(participant, &own);
	own_ = key_of(own);
}

void Publications::update()
{
	constexpr int kMostRounds = 20;
	constexpr std::size_t kMostKept = 20'000;  // [-] publications
	std::array<void*, 200> samples{};
	std::array<dds_sample_info_t, 200> infos{};
	int count = static_cast<int>(samples.size());
	for (int round = 0; round < kMostRounds && count == static_cast<int>(samples.size()); round++)
	{
		// Those that have gone leave nothing behind, since they are taken.
		count = dds_take(reader_, samples.data(), infos.data(), samples.size(), samples.size());
		for (int i = 0; i < count; i++)
		{
			const auto at = static_cast<std::size_t>(i);
			if (!infos[at].valid_data || infos[at].instance_state != DDS_IST_ALIVE)
			{
				all_.erase(infos[at].instance_handle);
				continue;
			}
			const auto& endpoint = *static_cast<const dds_builtintopic_endpoint_t*>(samples[at]);
			const ParticipantKey key = key_of(endpoint.participant_key);
			if (key == own_ || all_.size() >= kMostKept) continue;
			const bool has_hash = user_data_of(endpoint.qos).find("typehash=") != std::string::npos;
			all_[infos[at].instance_handle] = {key, endpoint.topic_name, endpoint.type_name, has_hash};
		}
		if (count > 0) dds_return_loan(reader_, samples.data(), count);
	}
}

std::vector<std::string> Publications::topics_of(const std::string& type, const std::string& other) const
{
	std::set<std::string> topics;
	for (const auto& [handle, publication] : all_)
		if (publication.type == type && publication.topic.rfind("rt/", 0) == 0 && publication.topic != wire_name(other))
			topics.insert(publication.topic.substr(2));
	return {topics.begin(), topics.end()};
}

namespace
{
/// Returns the length of the identifiers of the peers that tell which nodes they have; 0 if there is none or if they
/// differ. Endpoints of Iron and later carry the hash of their type.
int size_of_peers(const Publications& publications)
{
	constexpr int kHumble = 24, kIron = 16;
	std::map<ParticipantKey, std::pair<bool, bool>> participants;  // whether they tell of nodes, and have hashes
	for (const auto& [handle, publication] : publications.all())
	{
		auto& [tells, has_hash] = participants[publication.participant];
		tells |= publication.topic == kGraphTopic;
		has_hash |= publication.has_hash;
	}
	int size = 0;
	for (const auto& [participant, seen] : participants)
	{
		if (!seen.first) continue;
		const int here = seen.second ? kIron : kHumble;
		if (size != 0 && size != here) return 0;
		size = here;
	}
	return size;
}
}  // namespace

void Graph::update(
    const Publications& publications, const std::vector<Endpoint*>& readers, const std::vector<Endpoint*>& writers)
{
	const int size = size_of_peers(publications);
	if (size == size_ && told_ == readers.size() + writers.size()) return;
	if (size != size_)
	{
		writer_ = Entity();  // which takes back what was told
		size_ = size;
		if (size == 0) return;
		// The same type name on the wire, whichever of the two it is.
		const auto& wide = rmw_dds_common_msg_dds__ParticipantEntitiesInfo__desc;
		auto narrow = graph16_ParticipantEntitiesInfo_desc;
		narrow.m_typename = wide.m_typename;
		const dds_entity_t topic = make_topic(participant_, size == 24 ? wide : narrow, kGraphTopic);
		writer_ = checked(dds_create_writer(participant_, topic, qos_of({true, true, 1}).get(), nullptr), kGraphTopic);
	}
	if (size == 0) return;
	told_ = readers.size() + writers.size();
	if (size == 24)
		write_graph<
		    rmw_dds_common_msg_dds__ParticipantEntitiesInfo_, rmw_dds_common_msg_dds__NodeEntitiesInfo_,
		    rmw_dds_common_msg_dds__Gid_>(participant_, writer_, node_, space_, readers, writers);
	else
		write_graph<graph16_ParticipantEntitiesInfo, graph16_NodeEntitiesInfo, graph16_Gid>(
		    participant_, writer_, node_, space_, readers, writers);
}
}  // namespace d2s1r::live
