import "@fontsource-variable/inter/wght.css";
import "./style.css";

import { render } from "preact";

import { start } from "./core/app";
import * as replaying from "./core/replaying";
import { App } from "./ui/App";

const place = document.getElementById("app");
if (place === null) throw new Error("index.html lacks the element #app");
render(<App />, place);
start();
replaying.begin();
