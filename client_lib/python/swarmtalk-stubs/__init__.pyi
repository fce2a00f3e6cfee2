# The types of swarmtalk.py, for editors and type checkers; Python itself does not read this file. What
# each name is for stands in swarmtalk.py.
from asyncio import AbstractEventLoop, Future
from logging import Logger
from os import PathLike
from typing import Any, Awaitable, Callable, Dict, List, Literal, NamedTuple, Optional, Sequence, Tuple, TypeVar, Union

_Channel = Union[str, bytes, int]
_Data = Union[str, bytes, bytearray, memoryview]
_Sent = Union[bool, Refused]
_SentFunction = Union[Callable[[Optional[Error]], object], Literal[True], None]
_Redundancy = Union[int, Literal["auto"]]
_Self = TypeVar("_Self")
_LEFT_OUT: Any

__version__: str
DEFAULT_SOCKET: str
DEFAULT_QUEUE: int
MESSAGES_THAT_WAIT: int
UNKNOWN: float

class Error(Exception):
    code: str
    text: str
    def __init__(self, code: str, text: str) -> None: ...

class BadArgument(Error, ValueError): ...

class Refused:
    def __init__(self, code: str, text: str) -> None: ...
    def __bool__(self) -> Literal[False]: ...
    @property
    def code(self) -> str: ...
    @property
    def text(self) -> str: ...

class Record:
    def __init__(self, **values: Any) -> None: ...

class Pose(NamedTuple):
    x: float
    y: float
    theta: float
    age: float

class GatewayOrigin(NamedTuple):
    link: str
    node: int
    message_number: int

class Loss:
    air: int
    kernel: int
    daemon: int
    client: int
    late: int
    def __init__(self, air: int = 0, kernel: int = 0, daemon: int = 0, client: int = 0,
                 late: int = 0) -> None: ...
    @property
    def total(self) -> int: ...
    def add(self, other: Loss) -> None: ...
    def __bool__(self) -> bool: ...
    def __eq__(self, other: object) -> bool: ...
    def __ne__(self, other: object) -> bool: ...

class Message:
    data: bytes
    channel: int
    sender: int
    transmitter: int
    epoch: int
    message_number: int
    distance: float
    bearing: float
    sender_pose: Optional[Pose]
    hops: int
    ttl: int
    delay: Optional[float]
    received_at: Optional[float]
    local: bool
    origin: Optional[GatewayOrigin]
    lost_before: Loss
    def __init__(self, fields: Any) -> None: ...
    @property
    def text(self) -> str: ...
    @property
    def age(self) -> float: ...
    @property
    def has_distance(self) -> bool: ...
    @property
    def has_bearing(self) -> bool: ...

class Neighbour(Record):
    link: str
    node_id: int
    epoch: int
    address: str
    age: float
    distance: float
    bearing: float
    pose: Optional[Pose]
    frames: int
    frames_lost: int
    loss: float
    duplicate_id: bool
    out_of_range: bool
    ghost: bool

class _Link(Record):
    name: str
    type: str
    device: str
    up: bool
    state: str
    mtu_bytes: int
    max_message_bytes: int
    counters: Dict[str, int]
    profile: str
    max_ttl: int
    node_id: int
    max_channel: int

class _ChannelStatus(Record):
    number: int
    name: str
    publishers: int
    subscribers: int
    timestamped: bool
    received: int
    lost_air: int
    lost_kernel: int
    lost_daemon: int
    late: int
    onlookers: int
    refused: int
    links: List[str]

class _Program(Record):
    name: str
    pid: int
    uid: int
    subscriptions: int
    publishers: int
    queued_messages: int
    queued_bytes: int
    deliveries_sent: int
    lost_daemon: int
    lost_client: int
    messages_published: int
    refused: int

class _Status(Record):
    version: str
    node_id: int
    epoch: int
    uptime: float
    clients: int
    pose: Optional[Pose]
    links: List[_Link]
    channels: List[_ChannelStatus]
    counters: Dict[str, int]
    config_file: str
    node_id_fixed: bool
    programs: List[_Program]
    node_id_source: str

class _Handle:
    label: str
    channel_number: Optional[int]
    @property
    def status(self) -> Optional[Error]: ...
    def close(self) -> None: ...
    def __enter__(self: _Self) -> _Self: ...
    def __exit__(self, *unused: object) -> None: ...

class Publisher(_Handle):
    max_message_bytes: int
    has_redundancy: bool
    def __init__(self, client: Client, channel: _Channel, ttl: Optional[int], timestamped: Optional[bool],
                 queue: int, drop_oldest: bool, repeat: int, repeat_interval: Optional[float],
                 sent: _SentFunction, redundancy: _Redundancy = 0) -> None: ...
    @property
    def ttl(self) -> Optional[int]: ...
    @property
    def queue(self) -> int: ...
    @property
    def drop_oldest(self) -> bool: ...
    @property
    def repeat(self) -> int: ...
    @property
    def redundancy(self) -> _Redundancy: ...
    def send(self, data: _Data, ttl: Optional[int] = None) -> _Sent: ...
    def busy(self) -> bool: ...
    def async_send(self, data: _Data, ttl: Optional[int] = None) -> Future[None]: ...

class Subscriber(_Handle):
    def __init__(self, client: Client, channel: _Channel, receive: Optional[Callable[[Message], object]],
                 within: Optional[float], known_distance_only: bool, keep_last: Optional[int],
                 latest_from_each: bool, no_older_than: Optional[float],
                 timestamped: Optional[bool]) -> None: ...
    @property
    def within(self) -> Optional[float]: ...
    @property
    def known_distance_only(self) -> bool: ...
    @property
    def keep_last(self) -> Optional[int]: ...
    @property
    def latest_from_each(self) -> bool: ...
    @property
    def receive(self) -> Optional[Callable[[Message], object]]: ...
    def get(self, timeout: Optional[float] = None) -> Optional[Message]: ...
    def take(self) -> List[Message]: ...
    def __iter__(self) -> Subscriber: ...
    def __next__(self) -> Message: ...
    def next(self) -> Message: ...
    def __aiter__(self) -> Subscriber: ...
    def __anext__(self) -> Awaitable[Message]: ...

class Client:
    request_timeout: float
    connect_timeout: float
    node_id: int
    daemon_name: str
    on_disconnect: Optional[Callable[[Error], object]]
    on_reconnect: Optional[Callable[[], object]]
    on_gap: Optional[Callable[[Message], object]]
    on_error: Optional[Callable[[Error], object]]
    def __init__(self, name: Union[str, bytes],
                 socket_path: Union[str, bytes, PathLike[str], None] = None,
                 connect: bool = True) -> None: ...
    def __enter__(self: _Self) -> _Self: ...
    def __exit__(self, *unused: object) -> None: ...
    def connect(self) -> None: ...
    @property
    def connected(self) -> bool: ...
    def advertise(self, channel: _Channel, ttl: Optional[int] = None, timestamped: Optional[bool] = None,
                  queue: int = DEFAULT_QUEUE, drop_oldest: bool = False, repeat: int = 1,
                  repeat_interval: Optional[float] = None,
                  sent: _SentFunction = None, redundancy: _Redundancy = 0) -> Publisher: ...
    def subscribe(self, channel: _Channel, receive: Callable[[Message], object] = _LEFT_OUT,
                  within: Optional[float] = None, known_distance_only: bool = False,
                  keep_last: Optional[int] = None, latest_from_each: bool = False,
                  no_older_than: Optional[float] = None,
                  timestamped: Optional[bool] = None) -> Subscriber: ...
    def set_pose(self, x: float, y: float, theta: float) -> None: ...
    def set_fixed_pose(self, x: float, y: float, theta: float) -> None: ...
    def get_pose(self) -> Optional[Pose]: ...
    def neighbours(self) -> List[Neighbour]: ...
    def status(self) -> _Status: ...
    def sync(self) -> None: ...
    def log(self, line: _Data) -> _Sent: ...
    def fileno(self) -> int: ...
    def process(self) -> bool: ...
    def run(self, seconds: Optional[float] = None) -> None: ...
    def run_for(self, seconds: Optional[float] = None) -> None: ...
    def run_once(self, timeout: Optional[float] = None) -> None: ...
    def stop(self) -> None: ...
    def attach(self, loop: Optional[AbstractEventLoop] = None) -> AbstractEventLoop: ...
    def close(self) -> None: ...

class HarvestedValue(Record):
    node_id: int
    epoch: int
    hops: int
    local: bool
    key: str
    value: str
    data: bytes

class Harvest:
    MAX_KEY_BYTES: int
    MAX_VALUE_BYTES: int
    MAX_VALUES: int
    DEFAULT_TTL: int
    def __init__(self, client: Client) -> None: ...
    def set(self, key: _Data, value: _Data) -> None: ...
    def remove(self, key: _Data) -> None: ...
    def ask(self, prefix: _Data, found: Callable[[HarvestedValue], object],
            ttl: int = DEFAULT_TTL) -> _Sent: ...
    def close(self) -> None: ...

class _Id(int):
    def __call__(self) -> int: ...

class Robot:
    swarm: Client
    def __init__(self, robot: Any, client: Client, channel: _Channel = "coachbot",
                 within: Optional[float] = None) -> None: ...
    def __getattr__(self, name: str) -> Any: ...  # what the wrapped robot has, such as set_vel()
    def send_msg(self, msg: _Data) -> bool: ...
    @property
    def dropped(self) -> int: ...
    def recv_msg(self, clear: bool = False) -> List[bytes]: ...
    def recv(self) -> List[Message]: ...
    def get_pose(self) -> Optional[Tuple[float, float, float]]: ...
    def get_pose_blocking(self) -> Tuple[float, float, float]: ...
    def get_clock(self) -> float: ...
    def delay(self, ms: float = 20) -> None: ...
    @property
    def virtual_id(self) -> _Id: ...
    @property
    def id(self) -> _Id: ...
    @property
    def logger(self) -> Logger: ...

def wrap(robot: Any = None, channel: _Channel = "coachbot", within: Optional[float] = None,
         name: str = "usr_code") -> Robot: ...
def run_script(path: str, robot: Any = None, channel: _Channel = "coachbot",
               within: Optional[float] = None) -> None: ...
def main(arguments: Optional[Sequence[str]] = None) -> int: ...
