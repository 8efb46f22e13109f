"""Commands whose options may be given once, unless they take several values."""

from collections import Counter

from typer.core import TyperCommand, TyperOption


class Once(TyperCommand):
    """A command that refuses an option that is given twice: the last one would win without a word."""

    def parse_args(self, ctx, args):
        from harness.errors import UserError

        _, _, order = self.make_parser(ctx).parse_args(args=list(args))
        for option, count in Counter(order).items():
            if count > 1 and isinstance(option, TyperOption) and not option.multiple:
                name = max(option.opts, key=len)
                raise UserError(f"{name} is given {count} times", remedy=f"rayrace {self.name} takes it once")
        return super().parse_args(ctx, args)
