/* The C interface of libswarmtalk: one robot program's connection to the swarmtalkd of its robot.
 * The same rules as in C++ (docs/client.md): one thread, the caller's, owns a client and everything
 * it hands out, and callbacks run inside swarmtalk_process() and swarmtalk_run*() only. From any
 * thread may be called: swarmtalk_send(), swarmtalk_is_busy(), swarmtalk_stop().
 * A child of fork() opens a client of its own: with that of its parent every call is refused.
 *
 * Link with `pkg-config --cflags --libs swarmtalk-c`. Structures begin as zero (= {0}), which means
 * the default everywhere. Text is UTF-8 and ends with a zero. Nothing here throws or exits. */
#ifndef SWARMTALK_SWARMTALK_H
#define SWARMTALK_SWARMTALK_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define SWARMTALK_API __attribute__((visibility("default")))
#define SWARMTALK_LOOK __attribute__((warn_unused_result))

/* What became of a call. docs/client.md says what to do about each. */
typedef enum swarmtalk_status {
  SWARMTALK_OK = 0,
  SWARMTALK_BUSY = 1,
  SWARMTALK_TOO_LONG = 2,
  SWARMTALK_DISCONNECTED = 3,
  SWARMTALK_NO_DAEMON = 4,
  SWARMTALK_DAEMON_DEAD = 5,
  SWARMTALK_NO_PERMISSION = 6,
  SWARMTALK_VERSION_MISMATCH = 7,
  SWARMTALK_TIMEOUT = 8,
  SWARMTALK_BAD_CHANNEL = 9,
  SWARMTALK_CHANNEL_CONFLICT = 10,
  SWARMTALK_LIMIT = 11,
  SWARMTALK_BAD_TTL = 12,
  SWARMTALK_BAD_POSE = 13,
  SWARMTALK_UNSUPPORTED = 14,
  SWARMTALK_LINK_DOWN = 15,
  SWARMTALK_PROTOCOL = 16,
  SWARMTALK_DROPPED = 17,
  SWARMTALK_RATE = 18,
  SWARMTALK_BAD_ARGUMENT = 19,
  SWARMTALK_SYSTEM = 20
} swarmtalk_status;

/* A program's connection to the daemon of its robot. */
typedef struct swarmtalk_client swarmtalk_client;
/* Sends on a channel. */
typedef struct swarmtalk_publisher swarmtalk_publisher;
/* Hears a channel. */
typedef struct swarmtalk_subscriber swarmtalk_subscriber;
/* Values of this program for who asks, and questions. */
typedef struct swarmtalk_harvest swarmtalk_harvest;

/* Messages that did not come, by place; late: reported as lost before, came after all. */
typedef struct swarmtalk_loss {
  uint64_t air;
  uint64_t kernel;
  uint64_t daemon;
  uint64_t client;
  uint64_t late;
} swarmtalk_loss;

/* Valid during the callback. Grows at its end. */
typedef struct swarmtalk_message {
  const uint8_t* payload; /* exactly what was sent; not ended with a zero */
  size_t payload_bytes;
  uint16_t channel;
  uint32_t sender; /* node id of the origin */
  uint32_t epoch;
  uint32_t message_number;
  float distance_m;  /* to the last transmitter; NaN: unknown */
  float bearing_rad; /* counter-clockwise from this robot's heading; NaN: unknown */
  uint32_t hops;
  uint32_t ttl;
  int64_t buffering_delay_us; /* from send() to here, air left out; -1: unknown */
  int64_t received_at_ns;     /* CLOCK_MONOTONIC; -1: unknown */
  int local;                  /* 1: published on this robot by another program */
  swarmtalk_loss lost_before; /* since this subscription's message before */
  uint32_t transmitter;       /* node id of the last transmitter; with 0 hops the sender */
} swarmtalk_message;

/* Structs that you fill grow at their end. struct_bytes says how much of one you know, so that a
 * program that was compiled with an older swarmtalk.h goes on working: sizeof of the struct, or 0
 * for the members that were there in release 0.1. All that you do not set must be 0:
 *   swarmtalk_policy policy = {.struct_bytes = sizeof policy, .keep_last = 1};
 */
typedef struct swarmtalk_policy {
  size_t struct_bytes;
  uint32_t keep_last;        /* messages that wait; 1: only the newest; 0: the daemon's default */
  float max_distance_m;      /* 0: any */
  uint32_t max_age_ms;       /* 0: any */
  int drop_unknown_distance; /* that have none */
  int latest_from_each;      /* only the newest of each sender waits */
  int timestamped;           /* register the channel as timestamped */
} swarmtalk_policy;

/* For swarmtalk_sending.queue: one message is on its way at a time. */
#define SWARMTALK_NO_QUEUE UINT32_MAX

/* For swarmtalk_sending.redundancy: as many as the loss demands that is measured around. */
#define SWARMTALK_AUTO_REDUNDANCY UINT32_MAX

/* What becomes of messages that are sent faster than they leave. */
typedef struct swarmtalk_sending {
  size_t struct_bytes;       /* as in swarmtalk_policy */
  uint32_t ttl;              /* hops after the first */
  uint32_t queue;            /* messages that wait behind the one in flight; 0: 16 */
  int drop_oldest;           /* a full queue drops its oldest; else send() answers BUSY */
  uint32_t copies;           /* each message is sent that many times, delivered once; 0: once */
  uint32_t copy_interval_ms; /* 0: the daemon's default */
  int timestamped;
  uint32_t redundancy; /* repair packets of each message, at most 12; 0: none */
} swarmtalk_sending;

/* Called with each message. */
typedef void (*swarmtalk_receive_fn)(const swarmtalk_message* message, void* context);
/* Once for each accepted send(): SWARMTALK_OK when its last packet has left, else why it never
 * will. */
typedef void (*swarmtalk_sent_fn)(swarmtalk_status status, const char* text, void* context);
/* The text is a sentence for people. */
typedef void (*swarmtalk_event_fn)(swarmtalk_status status, const char* text, void* context);
/* Called before the message that has losses before it. */
typedef void (*swarmtalk_gap_fn)(const swarmtalk_message* message, void* context);

/* theta_rad: counter-clockwise from +x. NaN in all three: not known. */
typedef struct swarmtalk_pose {
  float x_m;
  float y_m;
  float theta_rad;
  uint32_t age_ms;
} swarmtalk_pose;

/* A robot heard within the last 10 s. Valid during the callback. */
typedef struct swarmtalk_neighbour {
  const char* link;
  uint32_t node_id;
  uint32_t epoch;      /* tells two starts of its daemon apart */
  const char* address; /* MAC, or IPv4 address and port; "": not known */
  uint32_t age_ms;     /* since it was heard last */
  float distance_m;    /* when it was heard last; NaN: unknown */
  float bearing_rad;   /* counter-clockwise from this robot's heading; NaN: unknown */
  swarmtalk_pose pose; /* the last it sent, with its age now */
  uint64_t frames;
  uint64_t frames_lost; /* gaps in its count of frames */
  float loss;           /* share of its frames that were lost lately, 0 to 1 */
  int duplicate_id;     /* another robot with this id is heard too */
  int out_of_range;     /* of the link's virtual_range_m: its messages are dropped */
} swarmtalk_neighbour;

/* One value of one program of a robot. Valid during the callback. */
typedef struct swarmtalk_value {
  uint32_t node_id;
  uint32_t epoch;
  uint32_t hops;
  int local; /* 1: of a program on this robot */
  const char* key;
  const char* value; /* ended with a zero, which is not counted; may hold zeros itself */
  size_t value_bytes;
} swarmtalk_value;

/* Called for each robot around. */
typedef void (*swarmtalk_neighbour_fn)(const swarmtalk_neighbour* neighbour, void* context);
/* Called for each value that comes. */
typedef void (*swarmtalk_value_fn)(const swarmtalk_value* value, void* context);

/* A client that is not connected yet. name: of the program, for the daemon's log and status; 1 to
 * 1024 bytes, else swarmtalk_connect() answers SWARMTALK_BAD_ARGUMENT. socket_path: NULL:
 * $SWARMTALK_SOCKET, else the standard one.
 * NULL when the process is out of memory or descriptors. */
SWARMTALK_API swarmtalk_client* swarmtalk_open(const char* name, const char* socket_path);
/* Ends everything; its publishers and subscribers must still be freed. NULL is fine. What was sent
 * last and refused is told here, or when the program ends by exit() or a return from main. */
SWARMTALK_API void swarmtalk_close(swarmtalk_client* client);

/* Waits until connected, two seconds at most. After a failure swarmtalk_run() goes on trying. */
SWARMTALK_API swarmtalk_status swarmtalk_connect(swarmtalk_client* client);
/* One sentence with the remedy, about the last call on this client's own thread that did not answer
 * SWARMTALK_OK, swarmtalk_send() too. Valid until the next such call. */
SWARMTALK_API const char* swarmtalk_error(const swarmtalk_client* client);
/* A general sentence about a status, for any thread. Never NULL. */
SWARMTALK_API const char* swarmtalk_status_text(swarmtalk_status status);

/* channel: a name, or a number in digits. policy, sending, sent: may be NULL; without receive the
 * answer is SWARMTALK_BAD_ARGUMENT. Returns NULL when out of memory or when struct_bytes is wrong
 * (see swarmtalk_error()); any other refusal is in *_status() and in on_error. */
SWARMTALK_API swarmtalk_subscriber* swarmtalk_subscribe(swarmtalk_client* client,
                                                        const char* channel,
                                                        const swarmtalk_policy* policy,
                                                        swarmtalk_receive_fn receive,
                                                        void* context);
/* SWARMTALK_OK while registered, else why not. */
SWARMTALK_API swarmtalk_status swarmtalk_subscriber_status(const swarmtalk_subscriber* subscriber);
/* Nothing more is heard; the handle is gone. */
SWARMTALK_API void swarmtalk_unsubscribe(swarmtalk_subscriber* subscriber);

/* A publisher on a channel. sending: NULL for the defaults; sent: may be NULL. Returns NULL when
 * out of memory or when struct_bytes is wrong; NULL answers SWARMTALK_BAD_ARGUMENT where it is
 * used. */
SWARMTALK_API swarmtalk_publisher* swarmtalk_advertise(swarmtalk_client* client,
                                                       const char* channel,
                                                       const swarmtalk_sending* sending,
                                                       swarmtalk_sent_fn sent, void* context);
/* SWARMTALK_OK while registered, else why not. */
SWARMTALK_API swarmtalk_status swarmtalk_publisher_status(const swarmtalk_publisher* publisher);
/* Hands one message to the daemon; copies it, never waits. Any thread. SWARMTALK_BUSY: as many wait
 * as may; this is also told on stderr, or to swarmtalk_on_error's callback, at most once a second,
 * except with SWARMTALK_NO_QUEUE, where it is to be expected. */
SWARMTALK_API SWARMTALK_LOOK swarmtalk_status swarmtalk_send(swarmtalk_publisher* publisher,
                                                             const void* bytes, size_t size_bytes);
/* 1: the next swarmtalk_send() would answer SWARMTALK_BUSY. Any thread. */
SWARMTALK_API int swarmtalk_is_busy(const swarmtalk_publisher* publisher);
/* Of the longest message; 0: not registered yet. */
SWARMTALK_API size_t swarmtalk_max_message_bytes(const swarmtalk_publisher* publisher);
/* Nothing more is sent; the handle is gone. */
SWARMTALK_API void swarmtalk_unadvertise(swarmtalk_publisher* publisher);

/* theta_rad: counter-clockwise from +x, in radians; more than a whole turn, as with degrees, is
   told once on stderr. */
SWARMTALK_API swarmtalk_status swarmtalk_set_pose(swarmtalk_client* client, float x_m, float y_m,
                                                  float theta_rad);
/* The same for a robot that stands still: the pose does not age, until another is set. */
SWARMTALK_API swarmtalk_status swarmtalk_set_fixed_pose(swarmtalk_client* client, float x_m,
                                                        float y_m, float theta_rad);
/* Asks the daemon, waits for its answer, a second at most. */
SWARMTALK_API swarmtalk_status swarmtalk_get_pose(swarmtalk_client* client, swarmtalk_pose* pose);
/* Asks the daemon, waits for its answer, a second at most, and calls `each` for every neighbour, by
 * link and node id, before it returns. */
SWARMTALK_API swarmtalk_status swarmtalk_neighbours(swarmtalk_client* client,
                                                    swarmtalk_neighbour_fn each, void* context);
/* Waits, a second at most, until the daemon has answered everything asked so far, and answers the
 * first refusal. */
SWARMTALK_API swarmtalk_status swarmtalk_sync(swarmtalk_client* client);
/* Sends a line to whoever listens to the reserved channel "debug" (`swarmtalk-cli log`), over a few
 * hops. Never waits. SWARMTALK_BAD_CHANNEL where the daemon's configuration has it off. */
SWARMTALK_API swarmtalk_status swarmtalk_log(swarmtalk_client* client, const char* line);
/* Of this robot; 0 before the first connection. */
SWARMTALK_API uint32_t swarmtalk_node_id(const swarmtalk_client* client);

/* Values for whoever asks, and questions for those of others, over several hops, on the reserved
 * channel "harvest". NULL only when out of memory. Close it before its client. */
SWARMTALK_API swarmtalk_harvest* swarmtalk_harvest_open(swarmtalk_client* client);
/* SWARMTALK_BAD_CHANNEL where the daemon's configuration has harvest off. */
SWARMTALK_API swarmtalk_status swarmtalk_harvest_status(const swarmtalk_harvest* harvest);
/* From now on this value answers questions for `key`, of 1 to 64 bytes; the value has at most 512.
 * 64 values at most: else SWARMTALK_BAD_ARGUMENT. NULL as the value removes it. */
SWARMTALK_API swarmtalk_status swarmtalk_harvest_set(swarmtalk_harvest* harvest, const char* key,
                                                     const char* value);
/* Asks all robots within `ttl` hops after the first (4 is usual) for their values whose keys begin
 * with `prefix`. Answers come to `found` until the next question; each is a message of its own that
 * may be lost, so ask again. Answers as swarmtalk_send() does. */
SWARMTALK_API swarmtalk_status swarmtalk_harvest_ask(swarmtalk_harvest* harvest, const char* prefix,
                                                     uint32_t ttl, swarmtalk_value_fn found,
                                                     void* context);
/* The values answer no more. */
SWARMTALK_API void swarmtalk_harvest_close(swarmtalk_harvest* harvest);

/* For an event loop of your own: readable when swarmtalk_process() has work. */
SWARMTALK_API int swarmtalk_fd(const swarmtalk_client* client);
/* Does everything that waits; never blocks. SWARMTALK_DISCONNECTED while there is no daemon. */
SWARMTALK_API swarmtalk_status swarmtalk_process(swarmtalk_client* client);
/* swarmtalk_process() in a loop, until swarmtalk_stop(). */
SWARMTALK_API swarmtalk_status swarmtalk_run(swarmtalk_client* client);
/* The same for a time, or until swarmtalk_stop(). */
SWARMTALK_API swarmtalk_status swarmtalk_run_for(swarmtalk_client* client, uint32_t time_ms);
/* Any thread, also a signal handler. */
SWARMTALK_API void swarmtalk_stop(swarmtalk_client* client);

/* Each replaces a default that writes a line to stderr; NULL silences it. The gap callback has no
 * default; it is called before the receive callback of a message that follows a loss. */
SWARMTALK_API void swarmtalk_on_disconnect(swarmtalk_client* client, swarmtalk_event_fn callback,
                                           void* context);
/* Called when the daemon is back. */
SWARMTALK_API void swarmtalk_on_reconnect(swarmtalk_client* client, swarmtalk_event_fn callback,
                                          void* context);
/* Called with what no call can tell; without one it is printed to stderr. */
SWARMTALK_API void swarmtalk_on_error(swarmtalk_client* client, swarmtalk_event_fn callback,
                                      void* context);
/* Called before a message with losses before it. */
SWARMTALK_API void swarmtalk_on_gap(swarmtalk_client* client, swarmtalk_gap_fn callback,
                                    void* context);

#ifdef __cplusplus
}
#endif

#endif /* SWARMTALK_SWARMTALK_H */
