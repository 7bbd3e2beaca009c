"""One node of the ranging protocol, without a clock and without a radio.

The program that owns the radio calls it when a preamble is detected, when a frame has arrived or
broken off, and at the `deadline`; the session returns frames to send at exact times, and events.
All times are 40-bit stamps of the node's own radio clock. `docs/reference/protocol.md` has the
rules, the bytes and the tables of states.
"""

from __future__ import annotations

from tracking.errors import ConfigError, WireError
from tracking.ranging.dice import Dice
from tracking.ranging.events import (
    DuplicateId,
    MembersChanged,
    Output,
    Reception,
    Role,
    RoleChanged,
)
from tracking.ranging.frames.slots import Slots
from tracking.ranging.frames.timestamps import MODULUS, OwnTime, ticks, unwrap
from tracking.ranging.frames.wire import MAX_ID, Frame, Type, decode
from tracking.ranging.joining import Joining
from tracking.ranging.listening import Listener
from tracking.ranging.members import Members
from tracking.ranging.params import SessionParams
from tracking.ranging.transmitter import Message, Transmitter
from tracking.ranging.turns import Turns, Waiting


class Session:
    """State machine of one node.

    Properties: no input raises an exception; there is always a deadline, and every state is left
    at its deadline.
    """

    def __init__(self, node_id: int, params: SessionParams, *, boot: int) -> None:
        """Set a node up; nothing happens before `start`.

        Args:
            node_id: 0 to 254, unique in the group.
            params: Parameters of the node.
            boot: A random number, drawn at every power-on.

        Raises:
            ConfigError: An ID out of range.
        """
        if not 0 <= node_id <= MAX_ID:
            raise ConfigError(f"node id: expected 0 to {MAX_ID}, got {node_id}")
        self.id, self._params, self._boot = node_id, params, boot & 0xFF
        self.role, self.root, self.round = Role.LISTENING, node_id, 0
        self._slots, self._dice = Slots(params.phy), Dice(node_id, boot)
        self.transmitter = Transmitter(node_id, params, self._slots, self._boot)
        self._listener, self._members = Listener(node_id, params.exchange), Members(node_id)
        self._peers = self._listener.peers
        self._turns = Turns(node_id, params, self._slots, self._members, self._peers, self._dice)
        self._time, self._joining = OwnTime(), Joining(self._dice)
        self._out: list[Output] = []
        self._last_output = (self.role, self.root), self.members

    @property
    def members(self) -> tuple[int, ...]:
        """IDs of the members of the round, as this node knows them."""
        return self._members.ids

    @property
    def deadline(self) -> int:
        """Time at which to call `timeout`, 40-bit stamp."""
        return self._turns.deadline % MODULUS

    def start(self, now: int) -> list[Output]:
        """Switch on."""
        self._time.set(now)
        self._begin()
        return self._give()

    def preamble(self, now: int) -> list[Output]:
        """Handle a detected preamble: `frame` or `broken` follows."""
        if self._advance(now) and self.role is not Role.MUTED:
            self._turns.hold(self._time.now)
        return self._give()

    def broken(self, now: int) -> list[Output]:
        """Handle an incoming signal that was not a frame."""
        if self._advance(now) and self._turns.waiting is Waiting.FRAME:
            self._unreadable()
        return self._give()

    def frame(self, data: bytes, reception: Reception, now: int) -> list[Output]:
        """Handle an incoming frame.

        Args:
            data: Bytes of the frame.
            reception: Radio data of the frame.
            now: Stamp of the present moment.
        """
        if not self._advance(now) or self.role is Role.MUTED:
            return self._give()
        self._turns.hold(self._time.now)
        arrived = unwrap(reception.stamp, self._time.now) - self._params.antenna_delay
        end = arrived + self._slots.frame(len(data))
        try:
            frame = decode(data)
        except WireError:
            frame = None
        if frame is None or frame.pan != self._params.pan or not self._recent(arrived):
            self._turns.foreign |= frame is not None
            self._unreadable()
        elif frame.src == self.id:
            self._own_id(frame, end)
        else:
            self._process_frame(frame, reception, arrived, end)
        return self._give()

    def timeout(self, now: int) -> list[Output]:
        """Handle the deadline."""
        turns = self._turns
        if not self._advance(now) or self._time.now < turns.deadline:
            return self._give()
        if turns.waiting is Waiting.FRAME:
            self._unreadable()
        elif turns.waiting is Waiting.TURN:
            self._transmit(max(turns.expected, self._time.now + self._slots.header))
        elif turns.waiting is Waiting.SLOT:
            self._silent_slot()
        elif turns.waiting is Waiting.PART:
            turns.expected += self._slots.silent
            self._await_slot()
        elif turns.waiting is Waiting.WATCHDOG:
            self._begin()
        else:
            self._become_initiator()
        return self._give()

    def _await_slot(self) -> None:
        leads = self.role is Role.INITIATOR
        shut_out = self._joining.in_vain and self.id not in self._members
        self._turns.await_slot(self._time.now, self.round, leads=leads, shut_out=shut_out)

    def _silent_slot(self) -> None:
        """Handle a slot at the cursor without a preamble."""
        at_request = self._turns.at_request
        if not self._turns.silent(self._time.now, self.root):
            self._turns.request_missing(self.root)
            return
        if at_request:  # others receive the initiator: its request was missed here
            self.round = (self.round + 1) % 256
        self._await_slot()

    def _become_initiator(self) -> None:
        """Start own rounds: the initiator and all earlier nodes in the succession are silent."""
        self._members.ids = tuple(k for k in self.members if k >= self.id)
        self.role, self.root = Role.INITIATOR, self.id
        self._members.ask_first(self._time.now)
        self._transmit(self._time.now + self._slots.turnaround + self._slots.header)

    def _transmit(self, at: int) -> None:
        """Send the own message, its first stamp moment at or after the given time."""
        turns, kind, root = self._turns, Type.JOIN, self.root
        if self.role is Role.INITIATOR and turns.at_request:
            kind = Type.REQUEST
            self._members.renew(self._peers, at, self._params.drop_after)
            self.round, turns.cursor, root = (self.round + 1) % 256, 0, self.members[0]
        elif self.id in self._members:
            kind = Type.REPLY
        n = len(self._members)
        rows = []
        if kind is not Type.JOIN:
            rows = self._peers.table(self._members.others(), self.transmitter.room)
        message = Message(kind, root, self.round, min(turns.cursor, n), n, rows)
        frames, sent, turns.expected = self.transmitter.send(message, at)
        self._out += frames
        self._listener.note_sent(sent)
        turns.cursor += kind is not Type.JOIN
        if kind is Type.REQUEST and n == 1:
            turns.expected += self._dice.pause(self._params.idle)
        if root != self.root:  # a smaller ID has joined and sends the next request
            self.role, self.root = Role.RESPONDER, root
        self._await_slot()

    def _insert(self, at: int) -> None:
        """Transmit at the start of the gap if a newcomer's attempt is due."""
        if self._time.now + self._slots.header <= at and self._joining.may_transmit(self.round):
            self._turns.check_at = self._time.now + self._dice.pause(self._params.first_check)
            self._transmit(at)

    def _process_frame(self, frame: Frame, reception: Reception, arrived: int, end: int) -> None:
        """Process a valid frame of another node, and keep in step with its round."""
        turns, in_turn = self._turns, frame.type in (Type.REQUEST, Type.REPLY)
        lost = turns.before in (Waiting.TAKEOVER, Waiting.WATCHDOG, Waiting.START)
        if self.role is Role.LISTENING and frame.root == self.id:
            turns.resume()  # from nodes that followed this ID before it was switched on again
            return
        follows = frame.root == self.root and self.role is not Role.LISTENING
        events = None
        if follows or (in_turn and (frame.root < self.root or lost)):
            events = self._listener.take(frame, reception, arrived)
        if events is None:  # a repeat, or of a group that will follow this one on reception
            self._unreadable()
            return
        self._out += events
        turns.received_at = self._time.now
        if in_turn:
            self._keep_step(frame)
        turns.expected = end + self._slots.gap
        if frame.part + 1 < frame.parts:
            turns.wait(Waiting.PART, turns.expected - self._slots.header + self._slots.sense)
            return
        self._await_slot()
        if self.id in self._members:
            self._joining.succeeded()
        else:
            self._insert(end + self._slots.turnaround)

    def _keep_step(self, frame: Frame) -> None:
        """Adopt round, slot, members and initiator of a request or a reply."""
        here = self.root, self.round, len(self._members)
        in_step = (frame.root, frame.round, frame.n) == here
        members = self._members.read(frame)
        self._turns.cursor = frame.slot + 1
        if self.role is Role.INITIATOR and frame.root == self.id:
            if not in_step:  # the others have lost the request: repeat it
                self._turns.cursor = len(self._members)
            return
        if members and (frame.type is Type.REQUEST or not in_step):
            self._members.ids = members
        self.round = frame.round
        if frame.root == self.id:  # handed over by a larger ID
            self._members.ask_first(self._time.now)
        self.role = Role.INITIATOR if frame.root == self.id else Role.RESPONDER
        self.root = frame.root

    def _own_id(self, frame: Frame, end: int) -> None:
        """Handle another node with the own ID: report it, alert it, and be silent for a while."""
        echo = frame.boot == self._boot
        if not echo:
            self._out.append(DuplicateId(self.id, frame.boot))
        if echo or frame.type is Type.ALERT:  # after an alert the other node is silent
            self._unreadable()
            return
        slot, at = min(frame.slot + 1, frame.n), max(end, self._time.now + self._slots.header)
        alert = Message(Type.ALERT, frame.root, frame.round, slot, frame.n)
        self._out += self.transmitter.send(alert, at + self._slots.turnaround)[0]
        self._forget()
        self.role, self.root = Role.MUTED, self.id
        self._turns.wait(Waiting.WATCHDOG, self._time.now + self._dice.pause(self._params.mute))

    def _unreadable(self) -> None:
        """Handle an unreadable transmission."""
        if self.role is Role.LISTENING:
            patience = self._turns.received_at + ticks(self._params.watchdog)
            self._listen() if self._time.now < patience else self._turns.resume()
            return
        turns = self._turns
        if self.role is Role.INITIATOR and self._dice.bits(2) == 0:
            turns.check_at = self._time.now  # lose step with a node that sent at the same time
        turns.unreadable(self._time.now, follows=self.role is Role.RESPONDER)
        if turns.before in (Waiting.TAKEOVER, Waiting.WATCHDOG):
            turns.request_missing(self.root)
        else:
            self._await_slot()

    def _begin(self) -> None:
        """Start again: listen before transmitting."""
        self._forget()
        self.role, self.root = Role.LISTENING, self.id
        self._members.ask_first(self._time.now)
        self._turns.received_at, self._turns.check_at = self._time.now, 0
        self._joining.begin()
        self._listen()

    def _listen(self) -> None:
        self._turns.wait(Waiting.START, self._time.now + self._dice.pause(self._params.listen))

    def _forget(self) -> None:
        self._listener.forget()
        self._members.ids = (self.id,)

    def _recent(self, arrived: int) -> bool:
        return 0 <= self._time.now - arrived <= self._slots.longest + self._slots.header

    def _advance(self, now: int) -> bool:
        """Update the time; return False and restart if the clock has jumped back."""
        goes_on = self._time.take(now)
        if not goes_on:
            self._begin()
        return goes_on

    def _give(self) -> list[Output]:
        """Return the outputs, and changes since the last time."""
        out, self._out = self._out, []
        role, members = self._last_output
        if role != (self.role, self.root):
            out.append(RoleChanged(self.role, self.root))
        if members != self.members:
            out.append(MembersChanged(self.members, members))
        self._last_output = (self.role, self.root), self.members
        return out
