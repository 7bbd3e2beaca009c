"""One node of the ranging protocol, without a clock and without a radio.

The shell that owns the radio calls it when a preamble is detected, when a frame has arrived or
broken off, and when the `deadline` has come; the session answers with frames to send at exact
times and with events. All times are 40-bit stamps of the node's own radio clock. The rules:

- Messages follow each other with a gap in which everybody listens. Whoever is not a member of
  the round yet speaks right at its start; the member whose turn it is speaks at its end.
- The initiator's request names the members; they answer by rising ID. A slot in which no
  preamble is heard is over at once, unless others do hear that node or it was lost and heard
  again lately: then it is waited out.
- Whoever hears a smaller ID follows it. Nodes that nobody heard for some rounds are dropped.
- If the initiator falls silent the next ID takes over (`succession`), or all are reset when
  their watchdog has run off, as in the paper.
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
from tracking.ranging.listening import Listener
from tracking.ranging.members import Members
from tracking.ranging.params import SessionParams
from tracking.ranging.slots import Slots
from tracking.ranging.speaker import Speaker, Words
from tracking.ranging.timestamps import MODULUS, ticks, unwrap
from tracking.ranging.turns import Turns, Waiting
from tracking.ranging.wire import MAX_ID, MAX_PARTS, Frame, Type, decode, entries_per_frame

_BACK = ticks(1e-3)
"""A clock that goes back by more has jumped."""


class Session:
    """The state machine of one node.

    Laws: never an exception, whatever comes in; there is always a deadline, and every state is
    left when its deadline has come.
    """

    def __init__(self, node_id: int, params: SessionParams, *, boot: int) -> None:
        """Set a node up; nothing happens before `start`.

        Args:
            node_id: 0 to 254, unique in the group.
            params: How it takes part.
            boot: A random number, drawn anew whenever the node is switched on.

        Raises:
            ConfigError: An ID out of range.
        """
        if not 0 <= node_id <= MAX_ID:
            raise ConfigError(f"node id: expected 0 to {MAX_ID}, got {node_id}")
        self.id, self._params, self._boot = node_id, params, boot & 0xFF
        self.role, self.root, self.round = Role.LISTENING, node_id, 0
        self._slots, self._dice = Slots(params.phy), Dice(node_id, boot)
        self._speaker = Speaker(node_id, params, self._slots, self._boot)
        self._listener, self._members = Listener(node_id, params.exchange), Members(node_id)
        self._peers = self._listener.peers
        self._turns = Turns(node_id, params, self._slots, self._members, self._peers, self._dice)
        self._now = self._attempts = self._backoff = 0
        self._asked_at = 0, 0  # begin of the last two rounds of this initiator
        self._tried_round: int | None = None
        self._out: list[Output] = []

    @property
    def members(self) -> tuple[int, ...]:
        """IDs of the members of the round that this node knows."""
        return self._members.ids

    @property
    def deadline(self) -> int:
        """When `timeout` is to be called, 40-bit stamp."""
        return self._turns.deadline % MODULUS

    def start(self, now: int) -> list[Output]:
        """Switch on."""
        self._now = now + MODULUS
        self._begin()
        return self._give()

    def preamble(self, now: int) -> list[Output]:
        """A preamble was detected: `frame` or `broken` will follow."""
        if self._advance(now) and self.role is not Role.MUTED:
            self._turns.hold(self._now)
        return self._give()

    def broken(self, now: int) -> list[Output]:
        """What came in was no frame."""
        if self._advance(now) and self._turns.waiting is Waiting.FRAME:
            self._unreadable()
        return self._give()

    def frame(self, data: bytes, reception: Reception, now: int) -> list[Output]:
        """A frame came in.

        Args:
            data: Its bytes.
            reception: What the radio tells of it.
            now: Stamp of this moment.
        """
        if not self._advance(now) or self.role is Role.MUTED:
            return self._give()
        self._turns.hold(self._now)
        arrived = unwrap(reception.stamp, self._now) - self._params.antenna_delay
        end = arrived + self._slots.frame(len(data))
        try:
            heard = decode(data)
        except WireError:
            heard = None
        on_time = 0 <= self._now - arrived <= self._slots.longest + self._slots.header
        if heard is None or heard.pan != self._params.pan or not on_time:
            self._unreadable()
        elif heard.src == self.id:
            self._own_id(heard, end)
        else:
            self._hear(heard, reception, arrived, end)
        return self._give()

    def timeout(self, now: int) -> list[Output]:
        """The deadline has come."""
        turns = self._turns
        if not self._advance(now) or self._now < turns.deadline:
            return self._give()
        if turns.waiting is Waiting.FRAME:
            self._unreadable()
        elif turns.waiting is Waiting.TURN:
            self._speak(max(turns.expected, self._now + self._slots.header))
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
        shut_out = self._attempts > 1 and self.id not in self._members
        self._turns.await_slot(self._now, self.round, leads=leads, shut_out=shut_out)

    def _silent_slot(self) -> None:
        """No preamble came in the slot at the cursor."""
        at_request = self._turns.at_request
        if not self._turns.silent(self._now, self.root):
            self._turns.request_missing(self.root)
            return
        if at_request:  # the initiator is there: its request went past here
            self.round = (self.round + 1) % 256
        self._await_slot()

    def _become_initiator(self) -> None:
        """Start rounds of one's own: the initiator and all before this node are silent."""
        before, self._members.ids = self.members, tuple(k for k in self.members if k >= self.id)
        self._tell_members(before)
        self._set_role(Role.INITIATOR, self.id)
        self._asked_at = self._now, self._now
        self._speak(self._now + self._slots.turnaround + self._slots.header)

    def _speak(self, at: int) -> None:
        """Send the own message, its first stamp moment at or after the given time."""
        turns, kind, root = self._turns, Type.JOIN, self.root
        if self.role is Role.INITIATOR and turns.at_request:
            kind, before = Type.REQUEST, self.members
            # What the last to speak have heard is told a round later: look two rounds back.
            self._members.renew(self._peers, self._asked_at[0], self._params.drop_after)
            self._tell_members(before)
            self.round, turns.cursor = (self.round + 1) % 256, 0
            self._asked_at = self._asked_at[1], at
            root = self.members[0]
        elif self.id in self._members:
            kind = Type.REPLY
        n = len(self._members)
        most = MAX_PARTS * entries_per_frame(self._params.phy.max_frame)
        rows = [] if kind is Type.JOIN else self._peers.table(self._members.others(), most)
        words = Words(kind, root, self.round, min(turns.cursor, n), n, rows)
        frames, sent, turns.expected = self._speaker.say(words, at)
        self._out += frames
        self._listener.spoken(sent)
        if kind is not Type.JOIN:
            turns.cursor += 1
        if kind is Type.REQUEST and n == 1:
            turns.expected += self._dice.pause(self._params.idle)
        if root != self.root:  # a smaller ID has joined: the next request is its
            self._set_role(Role.RESPONDER, root)
        self._await_slot()

    def _insert(self, at: int) -> None:
        """A newcomer speaks at the start of the gap, once a round and after drawn pauses."""
        if self.round == self._tried_round or self._now + self._slots.header > at:
            return
        if self._backoff > 0:
            self._backoff -= 1
            return
        self._attempts = min(self._attempts + 1, 5)
        self._backoff = self._dice.bits(self._attempts)
        self._tried_round = self.round
        self._turns.check_at = self._now + self._dice.pause(self._params.first_check)
        self._speak(at)

    def _hear(self, heard: Frame, reception: Reception, arrived: int, end: int) -> None:
        """Take a valid frame of another node, and one's place in the round that it tells."""
        turns, in_turn = self._turns, heard.type in (Type.REQUEST, Type.REPLY)
        lost = turns.before in (Waiting.TAKEOVER, Waiting.WATCHDOG, Waiting.START)
        if self.role is Role.LISTENING and heard.root == self.id:
            turns.resume()  # of those who followed this ID before it was switched on again
            return
        follows = heard.root == self.root and self.role is not Role.LISTENING
        if not follows and not (in_turn and (heard.root < self.root or lost)):
            self._unreadable()  # of a group that will follow this one once it hears it
            return
        events = self._listener.take(heard, reception, arrived)
        if events is None:
            self._unreadable()
            return
        self._out += events
        turns.heard_at = self._now
        if in_turn:
            self._keep_step(heard)
        turns.expected = end + self._slots.gap
        if heard.part + 1 < heard.parts:
            turns.wait(Waiting.PART, turns.expected - self._slots.header + self._slots.sense)
            return
        self._await_slot()
        if self.id in self._members:
            self._attempts = self._backoff = 0
        else:
            self._insert(end + self._slots.turnaround)

    def _keep_step(self, heard: Frame) -> None:
        """Take round, slot, members and initiator from a request or a reply."""
        here = self.root, self.round, len(self._members)
        in_step = (heard.root, heard.round, heard.n) == here
        members = self._members.read(heard)
        self._turns.cursor = heard.slot + 1
        if self.role is Role.INITIATOR and heard.root == self.id:
            if not in_step:  # the others have lost the request: ask again
                self._turns.cursor = len(self._members)
            return
        if members and (heard.type is Type.REQUEST or not in_step):
            before, self._members.ids = self.members, members
            self._tell_members(before)
        self.round = heard.round
        if heard.root == self.id:  # handed over by a larger ID
            self._asked_at = self._now, self._now
        leads = heard.root == self.id
        self._set_role(Role.INITIATOR if leads else Role.RESPONDER, heard.root)

    def _own_id(self, heard: Frame, end: int) -> None:
        """Another node uses this node's ID: report it, tell it, and keep silent for a while."""
        if heard.boot == self._boot:
            self._unreadable()  # an echo
            return
        self._out.append(DuplicateId(self.id, heard.boot))
        if heard.type is Type.ALERT:
            self._unreadable()
            return
        words = Words(Type.ALERT, heard.root, heard.round, min(heard.slot + 1, heard.n), heard.n)
        at = max(end, self._now + self._slots.header) + self._slots.turnaround
        self._out += self._speaker.say(words, at)[0]
        self._forget()
        self._set_role(Role.MUTED, self.id)
        self._turns.wait(Waiting.WATCHDOG, self._now + self._dice.pause(self._params.mute))

    def _unreadable(self) -> None:
        """Time went by with something on the air that tells nothing."""
        if self.role is Role.LISTENING:
            self._listen()
            return
        turns = self._turns
        if self.role is Role.INITIATOR and self._dice.bits(2) == 0:
            turns.check_at = self._now  # not in step with whoever spoke at the same time
        turns.unreadable(self._now, follows=self.role is Role.RESPONDER)
        if turns.before in (Waiting.TAKEOVER, Waiting.WATCHDOG):
            turns.request_missing(self.root)
        else:
            self._await_slot()

    def _begin(self) -> None:
        """Begin anew: listen before speaking."""
        self._forget()
        self._set_role(Role.LISTENING, self.id)
        self._asked_at, self._turns.heard_at = (self._now, self._now), self._now
        self._turns.check_at = self._attempts = self._backoff = 0
        self._tried_round = None
        self._listen()

    def _listen(self) -> None:
        self._turns.wait(Waiting.START, self._now + self._dice.pause(self._params.listen))

    def _forget(self) -> None:
        self._listener.forget()
        before, self._members.ids = self.members, (self.id,)
        self._tell_members(before)

    def _set_role(self, role: Role, root: int) -> None:
        if (role, root) != (self.role, self.root):
            self.role, self.root = role, root
            self._out.append(RoleChanged(role, root))

    def _tell_members(self, before: tuple[int, ...]) -> None:
        if self.members != before:
            self._out.append(MembersChanged(self.members, before))

    def _advance(self, now: int) -> bool:
        """Take the time; False if the clock has jumped back, and the node begins anew."""
        time = unwrap(now, self._now)
        jumped = time < self._now - _BACK
        self._now = time + MODULUS if jumped else max(time, self._now)
        if jumped:
            self._begin()
        return not jumped

    def _give(self) -> list[Output]:
        out, self._out = self._out, []
        return out
