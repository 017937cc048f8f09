/** Where the page begins: it is a live one, or what the HTML round it has recorded. */

import { Live } from "./live";
import { begin } from "./page";
import { openReplay } from "./replay";

void begin((root) => (window.ROLLER ? openReplay(root, window.ROLLER) : new Live(root)));
