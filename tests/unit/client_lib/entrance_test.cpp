// Who may come in, and what the others are told.
#include "client_lib/entrance.hpp"

#include <gtest/gtest.h>

#include <string>
#include <thread>
#include <vector>

namespace swarmtalk::client {
namespace {

class EntranceAlone : public testing::Test {
 protected:
  static Status done() { return Status(); }

  Reports reports_;
  int reported_ = 0;
  Entrance entrance_{reports_, [this] { ++reported_; }};
};

TEST_F(EntranceAlone, LetsOneInAndSaysWhatTheCallSays) {
  const Status status = entrance_.run([&] {
    EXPECT_TRUE(entrance_.is_mine());
    return Status(StatusCode::kDisconnected);
  });
  EXPECT_EQ(status.code(), StatusCode::kDisconnected);
  EXPECT_FALSE(entrance_.is_mine());
  EXPECT_EQ(reported_, 0);
}

TEST_F(EntranceAlone, LetsACallbackWaitButNotRun) {
  ASSERT_TRUE(entrance_.run([&] {
    EXPECT_TRUE(entrance_.wait(done));
    const Status inner = entrance_.run(done);
    EXPECT_EQ(inner.code(), StatusCode::kBadArgument);
    EXPECT_NE(inner.text().find("cannot be called inside a callback"), std::string::npos);
    return Status();
  }));
  EXPECT_EQ(reported_, 1);
  EXPECT_EQ(reports_.take().size(), 1u);
}

TEST_F(EntranceAlone, RefusesASecondThreadAndReportsIt) {
  ASSERT_TRUE(entrance_.wait([&] {
    std::thread([&] {
      EXPECT_EQ(entrance_.run(done).code(), StatusCode::kBadArgument);
      EXPECT_EQ(entrance_.wait(done).code(), StatusCode::kBadArgument);
      entrance_.try_wait([] { ADD_FAILURE() << "another thread is inside"; });
    }).join();
    return Status();
  }));
  EXPECT_EQ(reported_, 2) << "nobody misses what was only tried";
  for (const Status& report : reports_.take()) {
    EXPECT_NE(report.text().find("while another thread is inside it"), std::string::npos);
  }
}

TEST_F(EntranceAlone, IsEnteredAloneByNobodyThatIsInside) {
  int made = 0;
  EXPECT_TRUE(entrance_.try_alone([&] {
    ++made;
    EXPECT_FALSE(entrance_.try_alone([&] { ++made; }));
  }));
  EXPECT_EQ(made, 1);
}

TEST_F(EntranceAlone, TriesWhereNobodyElseIs) {
  int made = 0;
  entrance_.try_wait([&] { ++made; });
  ASSERT_TRUE(entrance_.run([&] {
    entrance_.try_wait([&] { ++made; });
    return Status();
  }));
  EXPECT_EQ(made, 2);
}

TEST_F(EntranceAlone, ReportsTwoThreadsThatCallInTurn) {
  const auto call = [&] {
    entrance_.run([&] {
      entrance_.note_caller();
      return Status();
    });
  };
  call();
  std::thread([&] {
    call();
    std::thread(call).join();  // this one lives on: the number of one that is gone is used again
    call();
  }).join();
  const std::vector<Status> reports = reports_.take();
  ASSERT_EQ(reports.size(), 1u);
  EXPECT_NE(reports[0].text().find("by two threads in turn"), std::string::npos);
}

}  // namespace
}  // namespace swarmtalk::client
