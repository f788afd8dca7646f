"""Orders of a plan as they are carried out: the one in force, those it runs into, and the tasks still due."""

from refseq.missions.plan import Order, Plan
from refseq.missions.tasks import Task


class Agenda:
    """The order in force, by its ``number`` in the plan; ``switches`` are the orders begun so far, each with its time.

    ``due`` are tasks by the order that they belong to.
    """

    def __init__(self, plan: Plan, start: float) -> None:
        self.plan = plan
        self.number = plan.order_at(start) if start > 0 else 0  # of several that begin at the start the first one
        self.due = {number: order.tasks for number, order in enumerate(plan.orders) if order.tasks}
        self.switches: list[tuple[int, float]] = []
        self._left: set[int] = set()  # orders behind the robot whose tasks were not done

    @property
    def order(self) -> Order:
        """The order in force."""
        return self.plan.orders[self.number]

    @property
    def last(self) -> int:
        """The last of the orders that are the present one over again: at their landmarks it goes on without a stop."""
        orders, last = self.plan.orders, self.number
        while last + 1 < len(orders) and orders[last + 1].continues(orders[last]):
            last += 1
        return last

    @property
    def at_end(self) -> bool:
        """True where no order follows."""
        return self.number + 1 == len(self.plan.orders)

    @property
    def end(self) -> float:
        """Place where something else begins [m along the way]."""
        return self.plan.end_of(self.last)

    @property
    def target(self) -> str:
        """Reason of the order that begins there."""
        after = self.last + 1
        return self.plan.orders[after].why if after < len(self.plan.orders) else "the goal"

    def begin(self, number: int, time: float) -> None:
        """Put an order in force at a time [s]."""
        self.number = number
        self.switches.append((number, time))

    def carried_over(self, plan: Plan) -> "Agenda":
        """The same agenda in a plan of which some orders ahead are others, or gone."""
        made = Agenda(plan, 0.0)
        numbers = {old: plan.orders.index(order) for old, order in enumerate(self.plan.orders) if order in plan.orders}
        made.number = numbers.get(self.number, max(n for n in numbers.values() if n <= self.number))
        made.switches = [(numbers[old], time) for old, time in self.switches if old in numbers]
        still_due = {numbers[old] for old in self.due if old in numbers}
        made.due = {n: tasks for n, tasks in made.due.items() if n > made.number or n in still_due}
        made._left = {numbers[old] for old in self._left if old in numbers}
        return made

    def leave_out(self, number: int, *, late: bool) -> list[Task]:
        """Tasks that are left out where an order is taken up; its own as well where it is taken up too ``late``.

        They stay due, for a robot that comes back, and are told once until it does.
        """
        behind = {other for other in self.due if other < number or (late and other == number)}
        new, self._left = sorted(behind - self._left), behind
        return [task for other in new for task in self.due[other]]

    def order_for(self, along: float, near: float) -> int | None:
        """The order to take up at a place [m along the way]; None behind the last one.

        An order that ends by itself was begun elsewhere: where its place is more than ``near`` [m] behind the robot, it
        is left out.
        """
        orders = self.plan.orders
        first = self.plan.order_at(along)
        taken_up = (n for n in range(first, len(orders)) if orders[n].travels or along - orders[n].at <= near)
        return next(taken_up, None)
