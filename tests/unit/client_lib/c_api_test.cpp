// The C interface without a daemon: no exception leaves it, and structs of other releases are read.
#include <gtest/gtest.h>
#include <swarmtalk/swarmtalk.h>

#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <new>
#include <string>
#include <thread>

namespace {

long allocations_left = -1;  // until one fails; negative: none does

void* allocate(std::size_t bytes) {
  if (allocations_left == 0) throw std::bad_alloc();
  if (allocations_left > 0) --allocations_left;
  if (void* memory = std::malloc(bytes == 0 ? 1 : bytes)) return memory;
  throw std::bad_alloc();
}

}  // namespace

void* operator new(std::size_t bytes) {
  return allocate(bytes);
}
void* operator new[](std::size_t bytes) {
  return allocate(bytes);
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete[](void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}
void operator delete[](void* memory, std::size_t) noexcept {
  std::free(memory);
}

namespace {

constexpr long kMostAllocations = 1000;  // of one call, by far

struct CloseClient {
  void operator()(swarmtalk_client* client) const { swarmtalk_close(client); }
};
using ClientHandle = std::unique_ptr<swarmtalk_client, CloseClient>;

ClientHandle opened() {
  return ClientHandle(swarmtalk_open("a robot with a name of some length", "/nonexistent/socket"));
}

/// Runs a call again and again; in each the allocation after those of the run before fails.
template <typename Call>
void with_every_allocation_failing(Call call) {
  for (long before = 0; before < kMostAllocations; ++before) {
    allocations_left = before;
    EXPECT_NO_THROW(call()) << "with " << before << " allocations";
    const bool is_through = allocations_left > 0;
    allocations_left = -1;
    if (is_through) return;
  }
  ADD_FAILURE() << "the call never came through";
}

void ignore_event(swarmtalk_status, const char*, void*) {}
void ignore_message(const swarmtalk_message*, void*) {}

TEST(CApi, NoExceptionLeavesItWhenMemoryIsOut) {
  with_every_allocation_failing([] { opened(); });
  const ClientHandle client = opened();
  ASSERT_NE(client, nullptr);
  with_every_allocation_failing([&] { swarmtalk_connect(client.get()); });
  with_every_allocation_failing([&] {
    swarmtalk_unsubscribe(swarmtalk_subscribe(client.get(), "a channel of a long name, not short",
                                              nullptr, ignore_message, nullptr));
  });
  with_every_allocation_failing([&] {
    swarmtalk_publisher* const made = swarmtalk_advertise(
        client.get(), "a channel of a long name, not short", nullptr, ignore_event, nullptr);
    if (made != nullptr) {
      EXPECT_NE(swarmtalk_send(made, "a message of some length, so that it is not short", 49),
                SWARMTALK_OK);
      swarmtalk_is_busy(made);
      swarmtalk_max_message_bytes(made);
      swarmtalk_publisher_status(made);
    }
    swarmtalk_unadvertise(made);
  });
  with_every_allocation_failing([&] { swarmtalk_set_pose(client.get(), 1, 2, 3); });
  with_every_allocation_failing([&] { swarmtalk_log(client.get(), "a line that is not short"); });
  with_every_allocation_failing([&] { swarmtalk_process(client.get()); });
  with_every_allocation_failing([&] { swarmtalk_run_for(client.get(), 0); });
  with_every_allocation_failing([&] {
    swarmtalk_on_disconnect(client.get(), ignore_event, nullptr);
    swarmtalk_on_reconnect(client.get(), ignore_event, nullptr);
    swarmtalk_on_error(client.get(), ignore_event, nullptr);
    swarmtalk_on_gap(client.get(), ignore_message, nullptr);
  });
}

/// As a newer swarmtalk.h has it.
template <typename Struct>
struct Newer {
  Struct known{};
  unsigned appended = 0;
};

TEST(CApi, StructOfANewerReleaseIsReadWhenItSaysNothingNew) {
  const ClientHandle client = opened();
  Newer<swarmtalk_sending> sending;
  sending.known.struct_bytes = sizeof sending;
  swarmtalk_publisher* const made =
      swarmtalk_advertise(client.get(), "c", &sending.known, ignore_event, nullptr);
  EXPECT_NE(made, nullptr);
  swarmtalk_unadvertise(made);
}

TEST(CApi, SubscriberWithoutAFunctionIsRefusedWithASentence) {
  const ClientHandle client = opened();
  swarmtalk_subscriber* const made =
      swarmtalk_subscribe(client.get(), "c", nullptr, nullptr, nullptr);
  ASSERT_NE(made, nullptr);
  EXPECT_EQ(swarmtalk_subscriber_status(made), SWARMTALK_BAD_ARGUMENT);
  EXPECT_STREQ(swarmtalk_error(client.get()),
               "the function that channel c was subscribed to with is empty: give one that takes "
               "each message");
  swarmtalk_unsubscribe(made);
}

TEST(CApi, ProgramWithoutANameIsRefusedWithASentence) {
  for (const char* name : {"", static_cast<const char*>(nullptr)}) {
    const ClientHandle client(swarmtalk_open(name, "/nonexistent/socket"));
    EXPECT_EQ(swarmtalk_connect(client.get()), SWARMTALK_BAD_ARGUMENT);
    EXPECT_STREQ(swarmtalk_error(client.get()),
                 "the name of this Client is empty; give it the name of your program");
  }
}

TEST(CApi, StructOfANewerReleaseThatAsksForMoreIsRefusedWithTheRemedy) {
  const ClientHandle client = opened();
  Newer<swarmtalk_policy> policy;
  policy.known.struct_bytes = sizeof policy;
  policy.appended = 7;
  EXPECT_EQ(swarmtalk_subscribe(client.get(), "c", &policy.known, ignore_message, nullptr),
            nullptr);
  const std::string told = swarmtalk_error(client.get());
  EXPECT_NE(told.find("swarmtalk_policy is of a newer release than this library"),
            std::string::npos)
      << told;
}

TEST(CApi, ErrorIsThatOfTheSendThatFailed) {
  ClientHandle client = opened();
  swarmtalk_publisher* const made =
      swarmtalk_advertise(client.get(), "c", nullptr, ignore_event, nullptr);
  ASSERT_NE(made, nullptr);
  EXPECT_EQ(swarmtalk_log(client.get(), nullptr), SWARMTALK_BAD_ARGUMENT);
  EXPECT_EQ(swarmtalk_send(made, nullptr, 5), SWARMTALK_BAD_ARGUMENT);
  EXPECT_STREQ(swarmtalk_error(client.get()), "the bytes to send are NULL, and not 5");
  EXPECT_EQ(swarmtalk_send(made, "x", 1), SWARMTALK_DISCONNECTED);
  const std::string told = swarmtalk_error(client.get());
  EXPECT_NE(told.find("not connected"), std::string::npos) << told;
  std::thread([&] { EXPECT_EQ(swarmtalk_send(made, nullptr, 5), SWARMTALK_BAD_ARGUMENT); }).join();
  EXPECT_EQ(swarmtalk_error(client.get()), told) << "of another thread";
  client.reset();
  EXPECT_NE(swarmtalk_send(made, "x", 1), SWARMTALK_OK) << "after its client";
  swarmtalk_unadvertise(made);
}

TEST(CApi, PublisherThatIsNullIsAnswered) {
  EXPECT_EQ(swarmtalk_send(nullptr, "x", 1), SWARMTALK_BAD_ARGUMENT);
  EXPECT_EQ(swarmtalk_publisher_status(nullptr), SWARMTALK_BAD_ARGUMENT);
  EXPECT_EQ(swarmtalk_is_busy(nullptr), 1);
  EXPECT_EQ(swarmtalk_max_message_bytes(nullptr), 0u);
  EXPECT_EQ(swarmtalk_subscriber_status(nullptr), SWARMTALK_BAD_ARGUMENT);
}

TEST(CApi, SizeThatIsNoneIsRefusedWithTheRemedy) {
  const ClientHandle client = opened();
  swarmtalk_sending sending{};
  sending.struct_bytes = 4;
  EXPECT_EQ(swarmtalk_advertise(client.get(), "c", &sending, ignore_event, nullptr), nullptr);
  EXPECT_STREQ(swarmtalk_error(client.get()),
               "struct_bytes of swarmtalk_sending is 4; set it to sizeof(swarmtalk_sending)");
}

}  // namespace
