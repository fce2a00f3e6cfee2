// The C interface against a daemon that says what it is told: what a program in C gets to see, and
// what the daemon is asked for.
#include <swarmtalk/swarmtalk.h>

#include <cmath>

#include "report/harvest_text.hpp"
#include "tests/unit/client_lib/client_fixture.hpp"

namespace swarmtalk::test {
namespace {

class ProgramInC : public testing::Test {
 protected:
  ProgramInC() { EXPECT_EQ(swarmtalk_connect(robot_), SWARMTALK_OK); }
  ~ProgramInC() override { swarmtalk_close(robot_); }

  bool run_until(const std::function<bool()>& holds) {
    const auto deadline = std::chrono::steady_clock::now() + kPatience;
    while (!holds() && std::chrono::steady_clock::now() < deadline) swarmtalk_run_for(robot_, 20);
    return holds();
  }
  /// All that the daemon was asked of this kind.
  std::vector<ipc::Envelope> asked(const std::function<bool(const ipc::Envelope&)>& is_it) {
    std::vector<ipc::Envelope> found;
    for (const ipc::Envelope& each : daemon_.received()) {
      if (is_it(each)) found.push_back(each);
    }
    return found;
  }
  // Once with the size of the struct and once without: what is asked is the same.
  ipc::Subscribe subscribed_with(swarmtalk_policy policy, const char* channel = "hello") {
    const ipc::Subscribe without = subscribed_as(policy, channel);
    policy.struct_bytes = sizeof policy;
    const ipc::Subscribe with = subscribed_as(policy, channel);
    EXPECT_EQ(with.SerializeAsString(), without.SerializeAsString());
    return with;
  }
  ipc::Subscribe subscribed_as(const swarmtalk_policy& policy, const char* channel) {
    swarmtalk_subscriber* const made = swarmtalk_subscribe(
        robot_, channel, &policy, [](auto*, void*) {}, nullptr);
    EXPECT_EQ(swarmtalk_sync(robot_), SWARMTALK_OK);
    EXPECT_EQ(swarmtalk_subscriber_status(made), SWARMTALK_OK);
    swarmtalk_unsubscribe(made);
    return asked([](const auto& each) { return each.has_subscribe(); }).back().subscribe();
  }
  ipc::Advertise advertised_with(swarmtalk_sending sending, const char* channel = "hello") {
    const ipc::Advertise without = advertised_as(sending, channel);
    sending.struct_bytes = sizeof sending;
    const ipc::Advertise with = advertised_as(sending, channel);
    EXPECT_EQ(with.SerializeAsString(), without.SerializeAsString());
    return with;
  }
  ipc::Advertise advertised_as(const swarmtalk_sending& sending, const char* channel) {
    swarmtalk_publisher* const made =
        swarmtalk_advertise(robot_, channel, &sending, nullptr, nullptr);
    EXPECT_EQ(swarmtalk_sync(robot_), SWARMTALK_OK);
    EXPECT_EQ(swarmtalk_publisher_status(made), SWARMTALK_OK);
    swarmtalk_unadvertise(made);
    return asked([](const auto& each) { return each.has_advertise(); }).back().advertise();
  }

  const std::string path_ = test_socket_path();
  FakeDaemon daemon_{path_};
  swarmtalk_client* robot_ = swarmtalk_open("a program", path_.c_str());
};

TEST_F(ProgramInC, GetsAllThatIsKnownOfAMessage) {
  struct Heard {
    int messages = 0;
    int gaps = 0;
    swarmtalk_message last{};
    std::string payload;
  } heard;
  swarmtalk_on_gap(
      robot_,
      [](const swarmtalk_message* message, void* to) {
        auto& all = *static_cast<Heard*>(to);
        EXPECT_EQ(all.messages, 0) << "before the message";
        EXPECT_EQ(message->lost_before.air, 4u);
        ++all.gaps;
      },
      &heard);
  swarmtalk_subscriber* const subscriber = swarmtalk_subscribe(
      robot_, "7", nullptr,
      [](const swarmtalk_message* message, void* to) {
        auto& all = *static_cast<Heard*>(to);
        ++all.messages;
        all.last = *message;
        all.payload.assign(reinterpret_cast<const char*>(message->payload), message->payload_bytes);
      },
      &heard);
  ipc::Deliver deliver;
  deliver.set_payload(std::string("a\0b", 3));
  deliver.set_channel(7);
  deliver.set_sender(3);
  deliver.set_epoch(99);
  deliver.set_message_number(12);
  deliver.set_distance_m(0.5F);
  deliver.set_bearing_rad(-1.5F);
  deliver.set_hops(1);
  deliver.set_ttl(2);
  deliver.set_transmitter(4);
  deliver.set_buffering_delay_us(1500);
  deliver.set_received_at_ns(123'456);
  deliver.set_local(true);
  deliver.mutable_lost_before()->set_air(4);
  deliver.mutable_lost_before()->set_kernel(5);
  deliver.mutable_lost_before()->set_daemon(6);
  deliver.mutable_lost_before()->set_late(8);
  daemon_.deliver(deliver);
  ASSERT_TRUE(run_until([&] { return heard.messages == 1; }));
  EXPECT_EQ(heard.gaps, 1);
  EXPECT_EQ(heard.payload, std::string("a\0b", 3));
  EXPECT_EQ(heard.last.channel, 7);
  EXPECT_EQ(heard.last.sender, 3u);
  EXPECT_EQ(heard.last.epoch, 99u);
  EXPECT_EQ(heard.last.message_number, 12u);
  EXPECT_EQ(heard.last.distance_m, 0.5F);
  EXPECT_EQ(heard.last.bearing_rad, -1.5F);
  EXPECT_EQ(heard.last.hops, 1u);
  EXPECT_EQ(heard.last.ttl, 2u);
  EXPECT_EQ(heard.last.transmitter, 4u);
  EXPECT_GE(heard.last.buffering_delay_us, 1500);
  EXPECT_EQ(heard.last.received_at_ns, 123'456);
  EXPECT_EQ(heard.last.local, 1);
  EXPECT_EQ(heard.last.lost_before.air, 4u);
  EXPECT_EQ(heard.last.lost_before.kernel, 5u);
  EXPECT_EQ(heard.last.lost_before.daemon, 6u);
  EXPECT_EQ(heard.last.lost_before.client, 0u);
  EXPECT_EQ(heard.last.lost_before.late, 8u);

  daemon_.deliver("x");
  ASSERT_TRUE(run_until([&] { return heard.messages == 2; }));
  EXPECT_EQ(heard.gaps, 1);
  EXPECT_TRUE(std::isnan(heard.last.distance_m));
  EXPECT_TRUE(std::isnan(heard.last.bearing_rad));
  EXPECT_EQ(heard.last.buffering_delay_us, -1);
  EXPECT_EQ(heard.last.received_at_ns, -1);
  EXPECT_EQ(heard.last.local, 0);
  swarmtalk_unsubscribe(subscriber);
}

TEST_F(ProgramInC, AsksForThePolicyThatItChose) {
  ipc::Subscribe plain = subscribed_with({});
  EXPECT_EQ(plain.channel().name(), "hello");
  EXPECT_FALSE(plain.has_keep_last());
  EXPECT_FALSE(plain.has_max_distance_m());
  EXPECT_FALSE(plain.has_max_age_ms());
  EXPECT_FALSE(plain.has_timestamped());
  EXPECT_FALSE(plain.drop_unknown_distance());
  EXPECT_FALSE(plain.latest_of_each());
  swarmtalk_policy policy{};
  policy.keep_last = 3;
  policy.max_distance_m = 1.5F;
  policy.max_age_ms = 250;
  policy.drop_unknown_distance = policy.latest_from_each = policy.timestamped = 1;
  ipc::Subscribe all = subscribed_with(policy, "12");
  EXPECT_EQ(all.channel().number(), 12u);
  EXPECT_EQ(all.keep_last(), 3u);
  EXPECT_EQ(all.max_distance_m(), 1.5F);
  EXPECT_EQ(all.max_age_ms(), 250u);
  EXPECT_TRUE(all.drop_unknown_distance());
  EXPECT_TRUE(all.latest_of_each());
  EXPECT_TRUE(all.timestamped());
  policy = {};
  policy.latest_from_each = 1;
  EXPECT_FALSE(subscribed_with(policy).drop_unknown_distance());
  EXPECT_EQ(subscribed_with({}, "12a").channel().name(), "12a");
}

TEST_F(ProgramInC, AsksForTheSendingThatItChose) {
  ipc::Advertise plain = advertised_with({});
  EXPECT_EQ(plain.queue(), 16u);
  EXPECT_EQ(plain.ttl(), 0u);
  EXPECT_FALSE(plain.drop_oldest());
  EXPECT_LE(plain.copies(), 1u);
  EXPECT_FALSE(plain.has_copy_interval_ms());
  EXPECT_FALSE(plain.timestamped());
  EXPECT_EQ(plain.redundancy(), 0u);
  EXPECT_FALSE(plain.auto_redundancy());
  swarmtalk_sending sending{};
  sending.ttl = 3;
  sending.queue = 5;
  sending.drop_oldest = sending.timestamped = 1;
  sending.copies = 4;
  sending.copy_interval_ms = 30;
  sending.redundancy = 2;
  ipc::Advertise all = advertised_with(sending);
  EXPECT_EQ(all.ttl(), 3u);
  EXPECT_EQ(all.queue(), 5u);
  EXPECT_TRUE(all.drop_oldest());
  EXPECT_TRUE(all.timestamped());
  EXPECT_EQ(all.copies(), 4u);
  EXPECT_EQ(all.copy_interval_ms(), 30u);
  EXPECT_EQ(all.redundancy(), 2u);
  sending = {};
  sending.queue = SWARMTALK_NO_QUEUE;
  sending.redundancy = SWARMTALK_AUTO_REDUNDANCY;
  all = advertised_with(sending);
  EXPECT_EQ(all.queue(), 0u);
  EXPECT_TRUE(all.auto_redundancy());
  EXPECT_FALSE(all.drop_oldest());
}

TEST_F(ProgramInC, SendsAndIsToldWhatBecameOfIt) {
  std::vector<swarmtalk_status> sent;
  swarmtalk_sending sending{};
  sending.struct_bytes = sizeof sending;
  sending.queue = SWARMTALK_NO_QUEUE;
  swarmtalk_publisher* const publisher = swarmtalk_advertise(
      robot_, "hello", &sending,
      [](swarmtalk_status status, const char* text, void* to) {
        EXPECT_STRNE(text, "");
        static_cast<std::vector<swarmtalk_status>*>(to)->push_back(status);
      },
      &sent);
  ASSERT_EQ(swarmtalk_sync(robot_), SWARMTALK_OK);
  EXPECT_EQ(swarmtalk_max_message_bytes(publisher), 100u);
  EXPECT_EQ(swarmtalk_node_id(robot_), 42u);
  daemon_.answers_publish = false;
  EXPECT_EQ(swarmtalk_is_busy(publisher), 0);
  EXPECT_EQ(swarmtalk_send(publisher, "abc", 2), SWARMTALK_OK);
  EXPECT_EQ(swarmtalk_is_busy(publisher), 1);
  EXPECT_EQ(swarmtalk_send(publisher, "abc", 3), SWARMTALK_BUSY);
  ASSERT_TRUE(run_until([&] { return daemon_.count(is_publish) == 1; }));
  EXPECT_EQ(asked(is_publish)[0].publish().payload(), "ab");
  daemon_.answer_publish();
  ASSERT_TRUE(run_until([&] { return sent.size() == 1; }));
  EXPECT_EQ(sent[0], SWARMTALK_OK);
  daemon_.answers_publish = true;
  daemon_.refuse_messages(ipc::ERROR_LINK_DOWN, "no link is up");
  EXPECT_EQ(swarmtalk_send(publisher, "abc", 3), SWARMTALK_OK);
  ASSERT_TRUE(run_until([&] { return sent.size() == 2; }));
  EXPECT_EQ(sent[1], SWARMTALK_LINK_DOWN);
  EXPECT_EQ(swarmtalk_send(publisher, nullptr, 3), SWARMTALK_BAD_ARGUMENT);
  EXPECT_STREQ(swarmtalk_error(robot_), "the bytes to send are NULL, and not 3");
  EXPECT_EQ(swarmtalk_send(publisher, nullptr, 0), SWARMTALK_OK);
  swarmtalk_unadvertise(publisher);
}

TEST_F(ProgramInC, SetsItsPoseAndAsksForIt) {
  const auto last_pose = [&] {
    return asked([](const auto& each) { return each.has_set_pose(); }).back().set_pose();
  };
  EXPECT_EQ(swarmtalk_set_pose(robot_, 1, 2, 0.5F), SWARMTALK_OK);
  ASSERT_EQ(swarmtalk_sync(robot_), SWARMTALK_OK);
  EXPECT_EQ(last_pose().x_m(), 1);
  EXPECT_EQ(last_pose().y_m(), 2);
  EXPECT_EQ(last_pose().theta_rad(), 0.5F);
  EXPECT_FALSE(last_pose().fixed());
  EXPECT_EQ(swarmtalk_set_fixed_pose(robot_, 3, 4, 0), SWARMTALK_OK);
  ASSERT_EQ(swarmtalk_sync(robot_), SWARMTALK_OK);
  EXPECT_EQ(last_pose().y_m(), 4);
  EXPECT_TRUE(last_pose().fixed());
  EXPECT_EQ(swarmtalk_set_pose(robot_, 33, 0, 0), SWARMTALK_BAD_POSE);

  bool is_known = true;
  daemon_.says = [&](const ipc::Envelope& request) -> std::vector<ipc::Envelope> {
    if (!request.has_get_pose()) return {};
    ipc::Envelope answer;
    ipc::Pose& pose = *answer.mutable_pose();
    if (is_known) {
      pose.set_x_m(1);
      pose.set_y_m(2);
      pose.set_theta_rad(0.5F);
      pose.set_age_ms(70);
    }
    return {answer};
  };
  swarmtalk_pose pose{};
  EXPECT_EQ(swarmtalk_get_pose(robot_, &pose), SWARMTALK_OK);
  EXPECT_EQ(pose.x_m, 1);
  EXPECT_EQ(pose.y_m, 2);
  EXPECT_EQ(pose.theta_rad, 0.5F);
  EXPECT_EQ(pose.age_ms, 70u);
  EXPECT_EQ(swarmtalk_get_pose(robot_, nullptr), SWARMTALK_BAD_ARGUMENT);
  EXPECT_STREQ(swarmtalk_error(robot_), "the pose is NULL");
  is_known = false;
  EXPECT_EQ(swarmtalk_get_pose(robot_, &pose), SWARMTALK_OK);
  EXPECT_TRUE(std::isnan(pose.x_m) && std::isnan(pose.y_m) && std::isnan(pose.theta_rad));
  daemon_.says = nullptr;
}

TEST_F(ProgramInC, IsToldOnceThatNobodyIsAroundAndWhatItTakes) {
  daemon_.says = [](const ipc::Envelope& request) -> std::vector<ipc::Envelope> {
    if (!request.has_get_neighbours()) return {};
    ipc::Envelope answer;
    answer.mutable_neighbours();
    return {answer};
  };
  const auto never = [](const swarmtalk_neighbour*, void*) { ADD_FAILURE() << "nobody is there"; };
  testing::internal::CaptureStderr();
  EXPECT_EQ(swarmtalk_neighbours(robot_, never, nullptr), SWARMTALK_OK);
  EXPECT_NE(testing::internal::GetCapturedStderr().find("beacon_ms"), std::string::npos);
  testing::internal::CaptureStderr();
  EXPECT_EQ(swarmtalk_neighbours(robot_, never, nullptr), SWARMTALK_OK);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  daemon_.says = nullptr;
}

TEST_F(ProgramInC, IsToldWhoIsAround) {
  daemon_.says = [](const ipc::Envelope& request) -> std::vector<ipc::Envelope> {
    if (!request.has_get_neighbours()) return {};
    ipc::Envelope answer;
    ipc::Neighbour& full = *answer.mutable_neighbours()->add_neighbours();
    full.set_link("wifi");
    full.set_node_id(7);
    full.set_epoch(9);
    full.set_address("02:00");
    full.set_age_ms(30);
    full.set_distance_m(1.5F);
    full.set_bearing_rad(-0.5F);
    full.mutable_pose()->set_x_m(1);
    full.mutable_pose()->set_y_m(2);
    full.mutable_pose()->set_theta_rad(3);
    full.mutable_pose()->set_age_ms(40);
    full.set_frames(100);
    full.set_frames_lost(8);
    full.set_loss(0.25F);
    full.set_duplicate_id(true);
    answer.mutable_neighbours()->add_neighbours()->set_out_of_range(true);
    return {answer};
  };
  struct Around {
    std::vector<swarmtalk_neighbour> all;
    std::vector<std::string> texts;
  } around;
  const auto note = [](const swarmtalk_neighbour* each, void* to) {
    auto& robots = *static_cast<Around*>(to);
    robots.all.push_back(*each);
    robots.texts.push_back(std::string(each->link) + " " + each->address);
  };
  ASSERT_EQ(swarmtalk_neighbours(robot_, note, &around), SWARMTALK_OK);
  ASSERT_EQ(around.all.size(), 2u);
  const swarmtalk_neighbour& full = around.all[0];
  EXPECT_EQ(around.texts[0], "wifi 02:00");
  EXPECT_EQ(full.node_id, 7u);
  EXPECT_EQ(full.epoch, 9u);
  EXPECT_EQ(full.age_ms, 30u);
  EXPECT_EQ(full.distance_m, 1.5F);
  EXPECT_EQ(full.bearing_rad, -0.5F);
  EXPECT_EQ(full.pose.x_m, 1);
  EXPECT_EQ(full.pose.y_m, 2);
  EXPECT_EQ(full.pose.theta_rad, 3);
  EXPECT_EQ(full.pose.age_ms, 40u);
  EXPECT_EQ(full.frames, 100u);
  EXPECT_EQ(full.frames_lost, 8u);
  EXPECT_EQ(full.loss, 0.25F);
  EXPECT_EQ(full.duplicate_id, 1);
  EXPECT_EQ(full.out_of_range, 0);
  const swarmtalk_neighbour& other = around.all[1];
  EXPECT_EQ(around.texts[1], " ");
  EXPECT_TRUE(std::isnan(other.distance_m) && std::isnan(other.bearing_rad));
  EXPECT_TRUE(std::isnan(other.pose.x_m));
  EXPECT_EQ(other.duplicate_id, 0);
  EXPECT_EQ(other.out_of_range, 1);
  EXPECT_EQ(swarmtalk_neighbours(robot_, nullptr, nullptr), SWARMTALK_BAD_ARGUMENT);
  EXPECT_STREQ(swarmtalk_error(robot_), "the callback is NULL");
  daemon_.says = nullptr;
}

TEST_F(ProgramInC, HarvestsValuesAndHasItsOwn) {
  swarmtalk_harvest* const harvest = swarmtalk_harvest_open(robot_);
  ASSERT_EQ(swarmtalk_sync(robot_), SWARMTALK_OK);
  EXPECT_EQ(swarmtalk_harvest_status(harvest), SWARMTALK_OK);
  EXPECT_EQ(swarmtalk_harvest_set(harvest, "battery", "4.1"), SWARMTALK_OK);
  EXPECT_EQ(swarmtalk_harvest_set(harvest, "state", "idle"), SWARMTALK_OK);
  EXPECT_EQ(swarmtalk_harvest_set(harvest, "state", nullptr), SWARMTALK_OK);
  EXPECT_EQ(swarmtalk_harvest_set(harvest, nullptr, "x"), SWARMTALK_BAD_ARGUMENT);
  daemon_.deliver(report::encode({7, 3, ""}));
  ASSERT_TRUE(run_until([&] { return daemon_.count(is_publish) == 1; }));
  std::string answer = report::begin_answer(7);
  report::append_value(answer, "battery", "4.1");
  EXPECT_EQ(asked(is_publish)[0].publish().payload(), answer);

  std::vector<std::string> found;
  const auto note = [](const swarmtalk_value* each, void* to) {
    EXPECT_EQ(each->node_id, 3u);
    EXPECT_EQ(each->epoch, 99u);
    EXPECT_EQ(each->hops, 2u);
    EXPECT_EQ(each->local, 0);
    static_cast<std::vector<std::string>*>(to)->push_back(
        std::string(each->key) + "=" + std::string(each->value, each->value_bytes));
  };
  EXPECT_EQ(swarmtalk_harvest_ask(harvest, "bat", 2, nullptr, nullptr), SWARMTALK_BAD_ARGUMENT);
  ASSERT_EQ(swarmtalk_harvest_ask(harvest, "bat", 2, note, &found), SWARMTALK_OK);
  ASSERT_TRUE(run_until([&] { return daemon_.count(is_publish) == 2; }));
  const ipc::Publish question = asked(is_publish)[1].publish();
  EXPECT_EQ(question.ttl(), 2u);
  const auto asked_for = report::decode_question(question.payload());
  ASSERT_TRUE(asked_for);
  EXPECT_EQ(asked_for->prefix, "bat");
  ipc::Deliver deliver;
  std::string theirs = report::begin_answer(asked_for->number);
  report::append_value(theirs, "battery", std::string("3\0009", 3));
  deliver.set_payload(theirs);
  deliver.set_sender(3);
  deliver.set_epoch(99);
  deliver.set_hops(2);
  daemon_.deliver(deliver);
  ASSERT_TRUE(run_until([&] { return !found.empty(); }));
  EXPECT_EQ(found, std::vector<std::string>{std::string("battery=3\0009", 11)});
  swarmtalk_harvest_close(harvest);
}

TEST_F(ProgramInC, IsToldOfTheDaemonsEndAndOfItsReturn) {
  std::vector<swarmtalk_status> lost, back, errors;
  const auto note = [](swarmtalk_status status, const char*, void* to) {
    static_cast<std::vector<swarmtalk_status>*>(to)->push_back(status);
  };
  swarmtalk_on_disconnect(robot_, note, &lost);
  swarmtalk_on_reconnect(robot_, note, &back);
  swarmtalk_on_error(robot_, note, &errors);
  swarmtalk_policy wrong{};
  wrong.struct_bytes = 3;
  EXPECT_EQ(swarmtalk_subscribe(robot_, "x", &wrong, nullptr, nullptr), nullptr);
  EXPECT_STRNE(swarmtalk_error(robot_), "");
  daemon_.kill();
  ASSERT_TRUE(run_until([&] { return !lost.empty(); }));
  EXPECT_EQ(swarmtalk_process(robot_), SWARMTALK_DISCONNECTED);
  daemon_.restart();
  ASSERT_TRUE(run_until([&] { return !back.empty(); }));
  EXPECT_EQ(lost, std::vector<swarmtalk_status>{SWARMTALK_DISCONNECTED});
  EXPECT_EQ(back, std::vector<swarmtalk_status>{SWARMTALK_OK});
  EXPECT_TRUE(errors.empty());
}

TEST_F(ProgramInC, HandlesThatAreNullAnswerSo) {
  EXPECT_EQ(swarmtalk_send(nullptr, "x", 1), SWARMTALK_BAD_ARGUMENT);
  EXPECT_EQ(swarmtalk_publisher_status(nullptr), SWARMTALK_BAD_ARGUMENT);
  EXPECT_EQ(swarmtalk_subscriber_status(nullptr), SWARMTALK_BAD_ARGUMENT);
  EXPECT_EQ(swarmtalk_is_busy(nullptr), 1);
  EXPECT_EQ(swarmtalk_max_message_bytes(nullptr), 0u);
  EXPECT_EQ(swarmtalk_log(robot_, nullptr), SWARMTALK_BAD_ARGUMENT);
  EXPECT_STREQ(swarmtalk_status_text(static_cast<swarmtalk_status>(SWARMTALK_SYSTEM + 1)),
               "unknown status");
  EXPECT_STRNE(swarmtalk_status_text(SWARMTALK_SYSTEM), "unknown status");
  swarmtalk_close(nullptr);
}

}  // namespace
}  // namespace swarmtalk::test
