#include "drivers/replay.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "loop/clock.hpp"
#include "tests/unit/drivers/test_link_user.hpp"

namespace swarmtalk::drivers {
namespace {

using namespace std::chrono_literals;

class ReplayLinkTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = std::filesystem::temp_directory_path() / "swarmtalk-replay-XXXXXX";
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string path(const std::string& name) const { return folder_ / name; }

  /// A capture with one frame for each stamp (microseconds), a packet with its index in each.
  void write_capture(const std::string& name, const std::vector<long>& stamps_us,
                     std::uint16_t ethertype = 0x88B5, int linktype = DLT_EN10MB) {
    pcap_t* const format = pcap_open_dead(linktype, 65535);
    pcap_dumper_t* const dumper = pcap_dump_open(format, path(name).c_str());
    ASSERT_NE(dumper, nullptr);
    for (std::size_t i = 0; i < stamps_us.size(); ++i) {
      Bytes bytes(1500, 0);
      bytes[12] = static_cast<std::uint8_t>(ethertype >> 8);
      bytes[13] = static_cast<std::uint8_t>(ethertype);
      frame::FrameHeader header;
      header.node = 9;
      frame::FrameWriter writer(std::span<std::uint8_t>(bytes).subspan(14), header, 1400);
      writer.append(numbered_packet(static_cast<std::uint32_t>(i), 10));
      writer.finish();
      pcap_pkthdr record{};
      record.ts = {stamps_us[i] / 1'000'000, stamps_us[i] % 1'000'000};
      record.caplen = record.len = 60;
      pcap_dump(reinterpret_cast<u_char*>(dumper), &record, bytes.data());
    }
    pcap_dump_close(dumper);
    pcap_close(format);
  }

  ReplayConfig config(const std::string& name) const {
    ReplayConfig result;
    result.capture_path = path(name);
    result.pace = ReplayPace::kFastest;
    return result;
  }

  void expect_refused(const ReplayConfig& refused, const std::string& words) {
    try {
      ReplayLink link(io_, refused);
      FAIL() << "was accepted";
    } catch (const std::runtime_error& error) {
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
  }

  std::filesystem::path folder_;
  boost::asio::io_context io_;
  TestLinkUser user_{1};
};

TEST_F(ReplayLinkTest, HandsUpEveryFrameOfTheCapture) {
  write_capture("in.pcap", std::vector<long>(200, 5));
  ReplayLink link(io_, config("in.pcap"));
  EXPECT_EQ(link.state(), "up, replaying " + path("in.pcap"));
  link.start(user_);
  ASSERT_TRUE(run_until(io_, [&] { return link.is_finished(); }));
  ASSERT_EQ(user_.received.size(), 200U);
  EXPECT_EQ(user_.received[199], numbered_packet(199, 10));
  EXPECT_EQ(user_.receptions[0].transmitter, 9);
  EXPECT_EQ(link.state(), "finished");
}

TEST_F(ReplayLinkTest, KeepsTheRecordedPace) {
  write_capture("in.pcap", {1'000'000, 1'030'000, 1'060'000});
  ReplayConfig recorded = config("in.pcap");
  recorded.pace = ReplayPace::kRecorded;
  ReplayLink link(io_, recorded);
  const auto before = loop::now();
  link.start(user_);
  ASSERT_TRUE(run_until(io_, [&] { return link.is_finished(); }));
  EXPECT_EQ(loop::now() - before, 60ms);
  EXPECT_EQ(user_.received.size(), 3U);
}

TEST_F(ReplayLinkTest, IgnoresOtherEthertypes) {
  write_capture("in.pcap", {1, 2}, 0x0800);
  ReplayLink link(io_, config("in.pcap"));
  link.start(user_);
  ASSERT_TRUE(run_until(io_, [&] { return link.is_finished(); }));
  EXPECT_TRUE(user_.received.empty());
}

TEST_F(ReplayLinkTest, WritesWhatIsTransmittedAsACaptureThatCanBeReplayed) {
  write_capture("in.pcap", {1});
  {
    ReplayConfig with_output = config("in.pcap");
    with_output.output_path = path("out.pcap");
    ReplayLink link(io_, with_output);
    user_.waiting.push_back(numbered_packet(77, 500));
    link.start(user_);
    ASSERT_TRUE(run_until(io_, [&] { return counter(link, "packets_sent") == 1; }));
    EXPECT_EQ(counter(link, "bytes_sent"), frame::kHeaderBytes + 2 + 500);
  }
  TestLinkUser again(2);
  ReplayLink link(io_, config("out.pcap"));
  link.start(again);
  ASSERT_TRUE(run_until(io_, [&] { return link.is_finished(); }));
  ASSERT_EQ(again.received.size(), 1U);
  EXPECT_EQ(again.received[0], numbered_packet(77, 500));
  EXPECT_EQ(again.receptions[0].transmitter, 1);
}

TEST_F(ReplayLinkTest, AnOutputThatIsFullIsInItsState) {
  write_capture("in.pcap", {1});
  ReplayConfig with_output = config("in.pcap");
  with_output.output_path = "/dev/full";
  ReplayLink link(io_, with_output);
  EXPECT_EQ(link.state().find("/dev/full"), std::string::npos);
  for (std::uint8_t i = 0; i < 2; ++i) user_.waiting.push_back(numbered_packet(i, 500));
  link.start(user_);
  ASSERT_TRUE(run_until(io_, [&] { return counter(link, "packets_sent") == 2; }));
  EXPECT_NE(link.state().find("cannot write /dev/full: No space left"), std::string::npos)
      << link.state();
}

TEST_F(ReplayLinkTest, EndsAtACaptureThatIsCutOff) {
  write_capture("in.pcap", {1, 2, 3});
  std::filesystem::resize_file(path("in.pcap"), std::filesystem::file_size(path("in.pcap")) - 10);
  ReplayLink link(io_, config("in.pcap"));
  link.start(user_);
  ASSERT_TRUE(run_until(io_, [&] { return link.is_finished(); }));
  EXPECT_EQ(user_.received.size(), 2U);
  EXPECT_EQ(link.state().substr(0, 8), "stopped:");
}

TEST_F(ReplayLinkTest, RefusesAMissingFile) {
  expect_refused(config("absent.pcap"), "No such file");
}

TEST_F(ReplayLinkTest, RefusesAFileThatIsNoCapture) {
  std::ofstream(path("text.pcap")) << "this is not a capture, but long enough to have a header";
  expect_refused(config("text.pcap"), "unknown file format");
}

TEST_F(ReplayLinkTest, RefusesACaptureOfAnotherLinktype) {
  write_capture("cooked.pcap", {1}, 0x88B5, DLT_LINUX_SLL);
  expect_refused(config("cooked.pcap"), "LINUX_SLL, it must be of Ethernet");
}

TEST_F(ReplayLinkTest, RefusesAnOutputThatCannotBeWritten) {
  write_capture("in.pcap", {1});
  ReplayConfig with_output = config("in.pcap");
  with_output.output_path = path("no/such/folder/out.pcap");
  expect_refused(with_output, "No such file");
}

}  // namespace
}  // namespace swarmtalk::drivers
